"""Every network, by the name that a Spec and the command line have for it."""

from typing import TYPE_CHECKING

from derain.system.registry import Registry

if TYPE_CHECKING:
    from derain.models.base import DerainingModule

# A file of derain/models enters its network by a decorator, `@NETWORKS.add("outdet")`. A package
# outside derain does the same, and names its module under the entry points `derain.networks`.
NETWORKS: "Registry[type[DerainingModule]]" = Registry(
    "derain.models", "derain.networks", "DerainingModule"
)
