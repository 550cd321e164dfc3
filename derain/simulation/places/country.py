"""A country road: hedges, fences, grass, trees in leaf or bare, ploughed fields, snow."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.random import Generator

from derain.scan import Floats, Ints
from derain.simulation.drawing import along
from derain.simulation.objects import Surface, Surfaces
from derain.simulation.places import ground, openwork, placing, plants
from derain.simulation.track import Track

# Extent of the roadside behind the sensor and ahead of it, metres.
COUNTRY_SIGHT = (-45.0, 75.0)


@dataclass(frozen=True)
class Road:
    """A road that bends as it leads away along x.

    Attributes:
        aside: Its middle beside the sensor, metres to the left.
        bend: Metres to the left per metre ahead squared.
        half_width: Metres.
    """

    aside: float
    bend: float
    half_width: float

    def beside(self, side: int, outwards: float) -> placing.Line:
        """The line at a distance outwards from its left (1) or right edge, metres."""
        return lambda x: self.aside + self.bend * x**2 + side * (self.half_width + outwards)

    def beside_it(self, x: float, y: float) -> bool:
        """True if a place is beside the road."""
        return bool(self.outside(x, y) > 0.5)

    def outside(self, x: Floats | float, y: Floats | float) -> Floats:
        """Distance of places from the road, metres; less than 0 on it."""
        from_middle = np.abs(y - self.aside - self.bend * np.asarray(x) ** 2)
        return np.asarray(from_middle - self.half_width)


def lay_out_country(generator: Generator) -> Track:
    """Lays out a country road.

    A road 3 to 7 m wide, bending, on hilly ground; on either side a verge, then a hedge, a fence or
    a bank with gaps, trees, and a field, a meadow or snow beyond. People, cyclists and cars are on
    the road and beside it, poles and cables follow it. In winter nothing has leaves.
    """
    aside, bend = generator.uniform(-3, 3), generator.uniform(-0.002, 0.002)
    road = Road(aside, bend, half_width=generator.uniform(1.5, 3.5))
    winter = generator.random() < 0.4
    snowy = winter and generator.random() < 0.5
    standing = [
        *placing.users(generator, walkers=(4, 12), cars=(2, 6)),
        *_verges(road, generator),
        *(thing for side in (-1, 1) for thing in _boundary(road, side, winter, snowy, generator)),
        *_trees(road, winter, generator),
        *_cables(road, generator),
        *placing.ragged_things(generator, road.beside_it, count=(10, 30), leafy=not winter),
    ]
    uneven = ground.Relief.draw(generator.uniform(0.05, 0.5), generator)
    return placing.assemble(_ground(road, snowy, generator), standing, uneven, generator)


def _ground(road: Road, snowy: bool, generator: Generator) -> Surfaces:
    surface = [ground.ASPHALT, ground.TRACK, ground.COBBLES][generator.choice(3, p=[0.6, 0.3, 0.1])]
    fields = [ground.SNOW] if snowy else [ground.FIELD, ground.MEADOW, ground.GRAVEL]
    beyond = [fields[which] for which in generator.integers(len(fields), size=2)]
    verge = ground.SNOW if snowy else ground.MEADOW
    broad = generator.uniform(1, 4)

    def kind_at(x: Floats, y: Floats) -> Ints:
        outside = road.outside(x, y)
        field = np.where(y > road.aside + road.bend * x**2, 2, 3)
        return np.where(outside < 0, 0, np.where(outside < broad, 1, field))

    yield from ground.ground_mesh([surface, verge, *beyond], kind_at, generator)


def _verges(road: Road, generator: Generator) -> Surfaces:
    for side in (-1, 1):
        for _ in range(generator.integers(1, 5)):
            count = int(generator.integers(50, 600))
            x = generator.normal(generator.uniform(-5, 25), 8, count)
            out = np.abs(generator.normal(0.2, generator.uniform(0.3, 2), count))
            y = road.beside(side, 0)(x) + side * out
            yield plants.grass(np.column_stack([x, y]), generator)


def _boundary(
    road: Road, side: int, winter: bool, snowy: bool, generator: Generator
) -> Iterable[Surface]:
    """The boundary along one side of the road, piece by piece."""
    line = road.beside(side, generator.uniform(1, 7))
    gaps = generator.uniform(0, 0.4)
    makes = {
        "hedge": _bare_hedge if winter else plants.hedge,
        "wire": openwork.wire_fence,
        "mesh": openwork.chain_link,
        "bank": partial(ground.bank, snow=snowy),
        "rail": openwork.guard_rail,
        "gate": openwork.railing,
    }
    make = makes[generator.choice(list(makes), p=[0.35, 0.2, 0.15, 0.15, 0.05, 0.1])]
    return placing.line_up(make, line, COUNTRY_SIGHT, generator.uniform(4, 9), generator, gaps)


def _bare_hedge(length: float, generator: Generator) -> Surfaces:
    height = generator.uniform(0.8, 2.5)
    for x in np.arange(0, length, 0.6):
        yield from placing.place(plants.brushwood(height, generator), x, 0)


def _trees(road: Road, winter: bool, generator: Generator) -> Surfaces:
    for side in (-1, 1):
        line, spacing = road.beside(side, generator.uniform(1.5, 10)), generator.uniform(6, 25)
        for x in along(*COUNTRY_SIGHT, (0.5 * spacing, spacing), generator):
            y = float(line(np.array(x))) + side * generator.uniform(0, 3)
            yield from placing.place(plants.tree(winter, generator), x, y, generator.uniform(0, 6))


def _cables(road: Road, generator: Generator) -> Surfaces:
    """Poles beside the road with one to four cables from each to the next."""
    line = road.beside(int(generator.choice([-1, 1])), generator.uniform(1.5, 6))
    spacing, height = generator.uniform(18, 40), generator.uniform(4.5, 8)
    x = generator.uniform(-spacing, 0) + spacing * np.arange(-1.0, 4.0)
    heads = np.column_stack([x, line(x), np.full_like(x, height)])
    feet = heads * (1, 1, 0)
    for foot, head in zip(feet, heads, strict=True):
        yield openwork.cable(foot, head, 0, (0.15, 0.3), generator)
    for number in range(generator.integers(1, 5)):
        shift = np.array([0, 0.4 * (number % 2) - 0.2, -0.4 * (number // 2)])
        for start, end in zip(heads[:-1] + shift, heads[1:] + shift, strict=True):
            yield openwork.cable(start, end, generator.uniform(0.2, 1), (0.005, 0.03), generator)
