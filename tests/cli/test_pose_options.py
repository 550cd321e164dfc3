"""``--poses``: what is told of poses while they are sought."""

from pathlib import Path

from derain.evaluation.hard_cases import scene


def test_odometry_on_request_tells_where_it_fails(succeed, tmp_path: Path) -> None:
    for number in range(3):  # scans of different places, with too little in them
        scene(300, seed=number).tofile(tmp_path / f"{number}.bin")
    options = ("--out", tmp_path / "out", "--poses", "odometry")
    outcome = succeed("run", "persistence", tmp_path, *options)
    first = outcome.err.splitlines()[0]
    assert first.startswith(
        f"derain: warning: {tmp_path / '1.bin'}: where it was taken is not known"
    )
    assert "1 more scan: its place is not known" in outcome.err
    assert len(list((tmp_path / "out").glob("*.label"))) == 3
