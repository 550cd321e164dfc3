"""Every draw has a generator of its own, which depends on nothing but what it is for."""

import itertools

from derain.learning.seeds import Draw, generator_of, run_seed


def test_no_two_draws_are_alike_and_each_is_always_the_same() -> None:
    # Zeros at the end among them: to NumPy's seeds, (1, 2) and (1, 2, 0) are one.
    keys = [
        (draw, seed, epoch, *number)
        for draw, seed, epoch in itertools.product(Draw, (0, 1, 2**32 - 1), (0, 1, 2))
        for number in ((), (0,), (1,), (0, 0), (1, 0), (0, 1))
    ]
    drawn = [generator_of(*key).integers(2**63) for key in keys]
    assert len(set(drawn)) == len(keys)
    assert drawn == [generator_of(*key).integers(2**63) for key in keys]


def test_the_seed_is_the_runs(monkeypatch) -> None:
    monkeypatch.delenv("PL_GLOBAL_SEED", raising=False)
    assert run_seed() == 0
    monkeypatch.setenv("PL_GLOBAL_SEED", "12345")  # as Lightning's seed_everything leaves it
    assert run_seed() == 12345
