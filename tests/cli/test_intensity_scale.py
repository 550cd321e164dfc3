"""Every command that judges scans warns of intensities of another unit, and can scale them."""

from pathlib import Path

import numpy as np
import pytest

from derain.pictures import scan_pictures

ONCE = "--methods ssr dror --timed 1 --repeats 1"


@pytest.fixture(autouse=True)
def small(here, monkeypatch, write_labelled) -> None:
    """Three labelled scans, and the same with intensities of a 1024th, which float32 holds."""
    monkeypatch.setattr(scan_pictures, "save", lambda figure, path: None)
    for number in range(3):
        scan = Path(f"usual/{number}.bin")
        for folder in ("usual", "small"):
            write_labelled(Path(folder, scan.name), Path(folder, f"{number}.label"), rain=110)
        points = np.fromfile(scan, np.float32).reshape(-1, 4)
        (points / np.array([1, 1, 1, 1024], np.float32)).tofile(f"small/{number}.bin")


@pytest.mark.parametrize(
    ("command", "title", "scans"),
    [
        ("run ssr {scans} --out {out} --set threshold=2000", "", 3),
        ("teach ssr {scans} --out {out} --set threshold=2000", "", 3),
        (f"bench --data {{scans}} --card wads {ONCE} --out {{out}}", "ssr: ", 3),
        ("tune ssr --data {scans} --card wads --trials 2 --out {out}.yaml", "", 3),
        ("view {scans}/0.bin --methods ssr --out {out}.png", "ssr: ", 1),
    ],
)
def test_another_unit_is_warned_of_once_and_can_be_scaled(succeed, command, title, scans) -> None:
    def messages(folder: str, *options: str) -> list[str]:
        return succeed(*command.format(scans=folder, out=f"of_{folder}").split(), *options).messages

    assert messages("usual") == []
    first, *more = messages("small")
    assert first.startswith(f"derain: warning: small/0.bin: {title}intensities of 0..1, but 0..255")
    others = f"derain: warning: {scans - 1} more scans: {title}intensity of a smaller unit"
    assert more == ([others] if scans > 1 else [])
    assert messages("small", "--intensity-scale", "1024") == []
    for labels in Path("of_usual").rglob("*.label"):
        assert (Path("of_small") / labels.relative_to("of_usual")).read_bytes() == (
            labels.read_bytes()
        )
