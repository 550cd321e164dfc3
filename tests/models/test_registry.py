"""Networks are found by the name that they have in a Spec."""

import pytest

from derain.errors import InputError
from derain.models.base import DerainingModule
from derain.models.cues import CueFusion
from derain.models.lisnownet import LiSnowNet
from derain.models.outdet import OutDet
from derain.models.published import Published
from derain.models.registry import NETWORKS
from derain.models.relative_outdet import RelativeOutDet
from derain.models.salsanext import SalsaNext
from derain.models.salsanext_lite import SalsaNextLite


def test_derain_has_these_networks_and_each_knows_its_name() -> None:
    assert dict(NETWORKS) == {
        "lisnownet": LiSnowNet,
        "outdet": OutDet,
        "cues": CueFusion,
        "relative_outdet": RelativeOutDet,
        "salsanext": SalsaNext,
        "salsanext_lite": SalsaNextLite,
    }
    assert {name: network.NAME for name, network in NETWORKS.items()} == {
        name: name for name in NETWORKS
    }
    published = {name for name, network in NETWORKS.items() if issubclass(network, Published)}
    assert published == {"lisnownet", "outdet", "salsanext"}


def test_a_network_without_a_name_is_refused_with_the_remedy() -> None:
    demanded = {name: lambda *_: None for name in DerainingModule.__abstractmethods__}
    nameless = type("Nameless", (DerainingModule,), demanded)
    with pytest.raises(InputError, match=r"Nameless: the network has no name\. Put @NETWORKS\.add"):
        nameless(channels=("x",))
