"""REHEARSE-3D: emulated rain, a MEMS LiDAR fused with a 4D radar."""

from derain.datamodules.base import Loading
from derain.datamodules.sequences import Sequences


class Rehearse3D(Sequences):
    """REHEARSE-3D as published: merged LiDAR and radar clouds, and the official split.

    The merged files hold x, y, z and intensity, without a mark on the radar's points.

    Example:
        >>> data = Rehearse3D("REHEARSE3D_PUBLIC")
        >>> data.card.name, len(data.split["train"])
        ('REHEARSE-3D', 86)

    Args:
        root: Folder ``REHEARSE3D_PUBLIC``.
        split: Sequences of ``train``, ``validation`` and ``test``, in place of the official ones.
        loading: Options for reading and batching scans.

    Source: sporsho/sporsho.github.io, REHEARSE3D.md, and the published ``data_cfg.yaml``.
    """

    def __init__(
        self,
        root: str,
        split: dict[str, list[str]] | None = None,
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(root, "rehearse3d", split, loading)
