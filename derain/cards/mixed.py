"""One data card of several data sets, whose classes keep the rain of each apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from derain.cards.card import DataCard, Moments
from derain.errors import InputError
from derain.scan import Ints


@dataclass(frozen=True)
class LabelMap:
    """Takes the class ids of one data set to those that they have on the card of several.

    Attributes:
        title: Name of the data set.
        ids: Id on the card of several, by its own id.
    """

    title: str
    ids: Mapping[int, int]

    def __call__(self, label: Ints, name: str) -> Ints:
        """Ids on the card of several, int64 (N,).

        Args:
            label: The data set's own ids, int64 (N,).
            name: Name of the labels in messages.

        Raises:
            InputError: Ids that are no classes of the data set.
        """
        present, places = np.unique(label, return_inverse=True)
        unknown = [id_ for id_ in present.tolist() if id_ not in self.ids]
        if unknown:
            raise InputError(
                name,
                f"ids {unknown[:5]} are no classes of {self.title}",
                "Name them in its data card.",
            )
        return np.array([self.ids[id_] for id_ in present.tolist()], np.int64)[places]


def label_maps(cards: Mapping[str, DataCard]) -> dict[str, LabelMap]:
    """Maps from each data set's class ids to those of all, which are numbered consecutively.

    Args:
        cards: Data cards, by the name of the part that each is of.
    """
    numbers = iter(range(sum(len(card.classes) for card in cards.values())))
    return {
        name: LabelMap(card.name, dict(zip(card.classes, numbers, strict=False)))
        for name, card in cards.items()
    }


def mixed_card(cards: Mapping[str, DataCard]) -> DataCard:
    """The data card of several data sets, without statistics.

    Its classes are those of all, called ``part: class``: what is rain to one may be none to
    another, and each can be counted by itself afterwards.

    Example:
        >>> from derain.cards.card import load_card
        >>> card = mixed_card({"snow": load_card("wads"), "rain": load_card("simulated")})
        >>> [card.classes[number] for number in card.rain]
        ['snow: falling-snow', 'rain: rain']
        >>> card.licence
        'CC BY-NC-SA 4.0 (WADS); MIT (simulated rain)'

    Args:
        cards: Data cards, by the name of the part that each is of.
    """
    maps, known = label_maps(cards), cards.values()
    licences = dict.fromkeys(f"{card.licence} ({card.name})" for card in known)
    return DataCard(
        name=" + ".join(dict.fromkeys(card.name for card in known)),
        classes={
            maps[name].ids[id_]: f"{name}: {title}"
            for name, card in cards.items()
            for id_, title in card.classes.items()
        },
        rain=tuple(maps[name].ids[id_] for name, card in cards.items() for id_ in card.rain),
        unknown=tuple(maps[name].ids[id_] for name, card in cards.items() for id_ in card.unknown),
        licence="; ".join(licences),
        intensity_unit=" or ".join(dict.fromkeys(card.intensity_unit for card in known)),
        simulated=any(card.simulated for card in known),
        deduplicate=any(card.deduplicate for card in known),
        parts={name: tuple(of_part.ids.values()) for name, of_part in maps.items()},
    )


def with_pooled_statistics(
    mixed: DataCard, cards: Sequence[DataCard], shares: Sequence[float]
) -> DataCard:
    """The card of several data sets with the statistics of a scan drawn from them.

    The scans of all are taken to have equally many points. What one of the cards does not know,
    the mixed one does not either.

    Args:
        mixed: The card of all.
        cards: The cards of the data sets.
        shares: Share of each among the scans that are drawn, of 1 in all.
    """
    pooled = {
        name: _pooled([card.moments[name] for card in cards], shares)
        for name in cards[0].moments
        if all(name in card.moments for card in cards)
    }
    rain = [card.rain_share for card in cards if card.rain_share is not None]
    rain_share = float(np.dot(rain, shares)) if len(rain) == len(cards) else None
    return replace(mixed, moments=pooled, rain_share=rain_share)


def _pooled(moments: Sequence[Moments], shares: Sequence[float]) -> Moments:
    """Mean and standard deviation of a value that is drawn from one of several distributions."""
    means, deviations = np.array(moments, np.float64).T
    mean = float(np.dot(shares, means))
    # About the common mean; the mean of squares less the square of the mean would cancel.
    return mean, sqrt(float(np.dot(shares, deviations**2 + (means - mean) ** 2)))
