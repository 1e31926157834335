"""A property that is computed once."""

from dataclasses import dataclass, field

from trackably.cached import cached


@dataclass(frozen=True)
class Counted:
    calls: list[int] = field(default_factory=list)

    @cached
    def doubled(self) -> int:
        """Twice as many."""
        self.calls.append(1)
        return 2 * len(self.calls)


def test_is_computed_once_on_first_use_and_for_each_instance_alone():
    one, other = Counted(), Counted()
    assert vars(one) == {"calls": []}
    assert (one.doubled, one.doubled, vars(one)["doubled"], one.calls) == (2, 2, 2, [1])
    assert other.calls == []


def test_may_be_given_beforehand():
    one = Counted()
    vars(one)["doubled"] = 7
    assert (one.doubled, one.calls) == (7, [])
