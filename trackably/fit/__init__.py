"""What a reference was learned from: how far it is from that, what its bounds cost, and where intervals end."""
