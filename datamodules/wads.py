"""WADS: real snow on a 64-beam LiDAR."""

from derain.datamodules.base import Loading
from derain.datamodules.sequences import Sequences


class Wads(Sequences):
    """WADS as published, with the split of 3D-OutDet.

    About 40 % of the points in its raw scans are duplicates. Scores count distinct points, as its
    data card states and the published results do; predictions cover every row of the file.

    Example:
        >>> data = Wads("WADS")
        >>> data.card.deduplicate, data.split["validation"]
        (True, ('11', '16'))

    Args:
        root: Folder of the data set.
        split: Sequences of ``train``, ``validation`` and ``test``, in place of the published ones.
        loading: Options for reading and batching scans.

    Source: A. Kurup, J. Bos, "DSOR: A Scalable Statistical Filter for Removing Falling Snow from
    LiDAR Point Clouds in Severe Winter Weather", 2021; split: sporsho/3D_OutDet.
    """

    def __init__(
        self,
        root: str,
        split: dict[str, list[str]] | None = None,
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(root, "wads", split, loading)
