"""LiSnowNet's selection of rain: a threshold on the change by denoising, and three limits."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Self

import numpy as np
import torch
from torch import Tensor

from derain.errors import InputError
from derain.files.documents import Entry
from derain.models.range_module import per_pixel
from derain.scan import Float32s, Scan
from derain.views.full_scale import full_scale

# Where a sensor on a vehicle sees the road well, metres from its axis.
NEAREST_ROAD, FARTHEST_ROAD = 3.0, 20.0

# The road is the lowest thing about, save for a few stray returns.
ROAD_PERCENTILE = 5

# With it, the limit that is fitted to WADS is the published one, -1.8 m.
ABOVE_ROAD = 0.4

# A residual is fitted to this many returns at least, and is at least an eighth of the one published
# for WADS: less is what the network changes where nothing falls.
FEWEST, LEAST_RESIDUAL = 100, 0.001

# Of their logarithms, Otsu's threshold is chosen from as many values.
OTSU_BINS = 256

# How surely a residual of twice the rule's threshold is rain: its logit.
STEEPNESS = 4.0

# Logit of what the rule decides whatever the residual is.
CERTAIN = 20.0


@dataclass(frozen=True)
class SelectionRule:
    """Constants of the rule.

    Attributes:
        residual: A return is rain where the change of its cube-rooted range times the cube of that
            of its cube-rooted intensity is greater.
        ground: And where it lies higher than this, metres in the sensor frame.
        intensity: And where its intensity is less than this share of the full scale.
        near: Or, whatever else, where it is nearer than this, metres; 0 for no such limit.
        full_scale: Intensity that counts as 1, in the data's unit.

    Raises:
        InputError: A residual or a full scale that is not above 0.

    Source: M.-Y. Yu et al., "LiSnowNet", IROS 2022, for the rule, ``residual`` and ``intensity``;
        published for WADS: residual 0.008, ground -1.8, intensity 2/255, near 2.5.
    """

    residual: float = 0.012
    ground: float = -1.8
    intensity: float = 2 / 255
    near: float = 0.0
    full_scale: float = 255.0

    def __post_init__(self) -> None:
        if not (self.residual > 0 and self.full_scale > 0):
            raise InputError(
                "rule",
                f"residual {self.residual:g} and full scale {self.full_scale:g}",
                "Both must be above 0.",
            )

    def with_residual_of(self, products: Float32s) -> Self:
        """The same rule with the residual that parts returns into changed and unchanged.

        It is Otsu's threshold of the logarithms, where the two groups are farthest apart for their
        spread; not less than LEAST_RESIDUAL, below which what is parted is noise. Fewer than
        FEWEST products leave it as it is.

        Args:
            products: Change of cube-rooted range times cubed change of cube-rooted intensity, of
                returns that height and intensity do not rule out, float32 (N,).
        """
        positive = products[products > 0]
        if len(positive) < FEWEST:
            return self
        parting = 10 ** otsu(np.log10(positive))
        return replace(self, residual=max(parting, LEAST_RESIDUAL))

    def as_dict(self) -> dict[str, float]:
        """The rule as JSON-able primitives, for a Spec, which :meth:`of` reads back."""
        return asdict(self)

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Reads back the rule of a Spec. It is not trusted.

        Raises:
            InputError: Constants missing, unknown, or that cannot be.
        """
        parsers = {field.name: Entry.number for field in fields(cls)}
        above_0 = {"residual": Entry.positive, "full_scale": Entry.positive}
        return cls(**entry.record({**parsers, **above_0}, required=tuple(parsers)))

    @classmethod
    def fitted(cls, stated: Mapping[str, float], scans: Sequence[Scan]) -> Self:
        """The rule for a sensor, from its scans without their labels, as far as it is not stated.

        The full scale is the smallest of 1, 255 and 65,535 that no intensity exceeds. The ground
        is 0.4 m above the 5th percentile of the heights of what lies 3 to 20 m away, in the median
        scan.

        Args:
            stated: Constants by name that are not to be fitted.
            scans: Training scans.

        Raises:
            InputError: A constant of another name.
        """
        names = [field.name for field in fields(cls)]
        if unknown := sorted(set(stated) - set(names)):
            raise InputError("rule", f"{unknown} are no constants of it", f"Available: {names}.")
        measured = {"full_scale": full_scale(scans), "ground": _road(scans) + ABOVE_ROAD}
        known = {name: value for name, value in measured.items() if np.isfinite(value)}
        return cls(**{**known, **stated})


def cube_roots(image: Tensor, rule: SelectionRule) -> Tensor:
    """The input of the network: cube roots of range and of intensity, in 0..1, float (B, 2, H, W).

    Args:
        image: Range (m), z (m) and intensity (the data's unit), float (B, 3, H, W).
        rule: Its full scale of intensity.
    """
    share = (image[:, 2:] / rule.full_scale).clamp(0, 1)
    return torch.cat([image[:, :1], share], dim=1) ** (1 / 3)


def rain_logits(
    image: Tensor, valid: Tensor, seen: Tensor, denoised: Tensor, rule: SelectionRule
) -> Tensor:
    """Logits of "not rain" and "rain" of every pixel, float (B · H · W, 2), row by row.

    The published rule decides yes or no. Here its limit is a probability of one half, from which
    the residual moves it. A pixel without a return is not rain.

    Args:
        image: Range (m), z (m) and intensity (the data's unit), float (B, 3, H, W).
        valid: Pixels with a return, bool (B, 1, H, W).
        seen: Input of the network, float (B, 2, H, W).
        denoised: Output of the network, float (B, 2, H, W).
        rule: The rule.
    """
    excess = denoising_change(seen, denoised) / rule.residual - 1
    margin = (STEEPNESS * excess).clamp(-CERTAIN, CERTAIN)
    margin = torch.where(may_be_rain(image, rule), margin, -CERTAIN)
    margin = torch.where(image[:, :1] < rule.near, CERTAIN, margin)
    margin = torch.where(valid, margin, -CERTAIN)
    return per_pixel(torch.cat([-margin, margin], dim=1) / 2)


def denoising_change(seen: Tensor, denoised: Tensor) -> Tensor:
    """The change by denoising: of range, times that of intensity cubed, float (B, 1, H, W)."""
    of_range, of_intensity = (denoised - seen).split(1, dim=1)
    return of_range * of_intensity**3


def may_be_rain(image: Tensor, rule: SelectionRule) -> Tensor:
    """True for pixels that may be rain by their height and intensity, bool (B, 1, H, W)."""
    _, height, intensity = image.split(1, dim=1)
    return (height > rule.ground) & (intensity < rule.intensity * rule.full_scale)


def otsu(values: Float32s) -> float:
    """Threshold that parts values into the two groups of least variance within.

    Args:
        values: Finite values, float32 (N,), N > 0; all the same, they are their own threshold.

    Source: N. Otsu, "A Threshold Selection Method from Gray-Level Histograms", 1979.
    """
    lowest, highest = float(values.min()), float(values.max())
    if lowest == highest:
        return lowest
    counts, edges = np.histogram(values.astype(np.float64), OTSU_BINS, (lowest, highest))
    centres = (edges[1:] + edges[:-1]) / 2
    below, total = np.cumsum(counts)[:-1], np.cumsum(counts * centres)[:-1]
    above = counts.sum() - below
    rest = (counts * centres).sum() - total
    # Both groups hold something: the outermost bins do.
    between = below * above * (total / below - rest / above) ** 2
    # Where an empty stretch lies between the groups, every threshold in it is as good.
    best = np.flatnonzero(between == between.max())
    return float(edges[1:-1][best].mean())


def _road(scans: Sequence[Scan]) -> float:
    """Height of the road in metres; not a number where no scan shows any."""
    heights = []
    for scan in scans:
        x, y, z = scan.xyz[scan.valid].T
        distance = np.hypot(x, y)
        about = z[(distance > NEAREST_ROAD) & (distance < FARTHEST_ROAD)]
        if len(about):
            heights.append(np.percentile(about, ROAD_PERCENTILE))
    return float(np.median(heights)) if heights else np.nan
