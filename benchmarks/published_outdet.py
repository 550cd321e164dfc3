"""The rival: 3D-OutDet's published pipeline, written plainly.

scikit-learn's KDTree, NumPy normalisation and the eager PyTorch network, einsum by einsum. Own
code; Source: sporsho/3D_OutDet (MIT): dataset/_point_cloud_dataset.py and modules/_out_det.py,
whose own run on a CPU gives its KDTree leaves of 200 points.
"""

from collections.abc import Mapping

import numpy as np
import torch
from sklearn.neighbors import KDTree
from torch import Tensor
from torch.nn import functional

from derain.scan import Bools, Float32s

NEIGHBOURS = 9


class PublishedPipeline:
    """From points to a mask.

    Args:
        weights: Published state_dict.
        mean: Mean of x, y, z and intensity.
        std: Their standard deviations.
        leaf_size: Points in a leaf of the KDTree.
    """

    def __init__(
        self,
        weights: Mapping[str, Tensor],
        mean: tuple[float, ...],
        std: tuple[float, ...],
        leaf_size: int,
    ) -> None:
        self.weights = weights
        self.mean = np.array(mean)
        self.std = np.array(std)
        self.leaf_size = leaf_size

    def __call__(self, points: Float32s) -> Bools:
        """Returns True for points, float32 (N, 4), that are rain, bool (N,)."""
        tree = KDTree(points[:, :3], leaf_size=self.leaf_size)
        distances, neighbours = tree.query(points[:, :3], k=NEIGHBOURS)
        normalised = torch.from_numpy(((points - self.mean) / self.std).astype(np.float32))
        with torch.no_grad():
            logits = self.network(
                normalised,
                torch.from_numpy((distances + 1.0).astype(np.float32)),
                torch.from_numpy(neighbours),
            )
        return logits.argmax(dim=1).numpy().astype(bool)

    def network(self, points: Tensor, distances: Tensor, neighbours: Tensor) -> Tensor:
        """Logits, float (N, 2)."""
        block = {key.removeprefix("convs.0."): value for key, value in self.weights.items()}
        seen = torch.cat([points[neighbours], (block["conv1.dw"] * distances)[..., None]], dim=-1)
        features = torch.einsum("ijk,klj->il", seen, block["conv1.weight"]) + block["conv1.b"]
        features = functional.leaky_relu(_batch_norm(features, block, "bn1"), 0.2)
        features = torch.einsum("ijk,klj->il", features[neighbours], block["conv2.weight"])
        shortcut = functional.conv1d(points[..., None], block["downsample.weight"]).squeeze(-1)
        features = functional.leaky_relu(_batch_norm(features, block, "bn2") + shortcut, 0.2)
        return functional.linear(features, block["fc.weight"], block["fc.bias"])


def _batch_norm(features: Tensor, block: Mapping[str, Tensor], name: str) -> Tensor:
    return functional.batch_norm(
        features,
        block[f"{name}.running_mean"],
        block[f"{name}.running_var"],
        block[f"{name}.weight"],
        block[f"{name}.bias"],
    )
