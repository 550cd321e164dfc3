"""Every view, by the name that it has in a Spec."""

from derain.system.registry import Registry
from derain.views.view import View

VIEWS: Registry[type[View]] = Registry("derain.views", attribute="NAME")
