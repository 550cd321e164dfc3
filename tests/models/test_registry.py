"""Networks are found by the name that they have in a Spec."""

import pytest

from derain.errors import InputError
from derain.models.base import DerainingModule
from derain.models.published import Published
from derain.models.registry import NETWORKS


def test_derain_has_these_networks_and_each_knows_its_name() -> None:
    names = ("cues", "lisnownet", "outdet", "salsanext", "salsanext_lite")
    assert {name: network.NAME for name, network in NETWORKS.items()} == {n: n for n in names}
    published = {name for name, network in NETWORKS.items() if issubclass(network, Published)}
    assert published == {"lisnownet", "outdet", "salsanext"}


def test_a_network_without_a_name_is_refused_with_the_remedy() -> None:
    demanded = {name: lambda *_: None for name in DerainingModule.__abstractmethods__}
    nameless = type("Nameless", (DerainingModule,), demanded)
    with pytest.raises(InputError, match=r"Nameless: the network has no name\. Put @NETWORKS\.add"):
        nameless(channels=("x",))
