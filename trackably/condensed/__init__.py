"""Many samples as fewer ones that say the same of every signal which is a polynomial between their centres."""
