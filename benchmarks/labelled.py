"""Scans with the labels that lie beside them."""

from pathlib import Path

from derain.files import read_scan
from derain.files.labels import label_beside, read_labels
from derain.scan import Scan


def read_labelled(path: Path) -> Scan:
    """Reads a scan and its labels."""
    scan = read_scan(path)
    return scan.with_label(read_labels(label_beside(path), len(scan)))
