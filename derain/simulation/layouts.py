"""The kinds of places that a sequence may be simulated in, by the names that users type."""

from collections.abc import Callable

from numpy.random import Generator

from derain.simulation import facility
from derain.simulation.places import city, country, garage, motorway, room, yard
from derain.simulation.track import Track

# Each lays out another place of its kind for every state of the generator. The origin of the track
# is on the ground under the sensor.
LAYOUTS: dict[str, Callable[[Generator], Track]] = {
    "city": city.lay_out_city,
    "country": country.lay_out_country,
    "facility": facility.lay_out_facility,
    "garage": garage.lay_out_garage,
    "motorway": motorway.lay_out_motorway,
    "room": room.lay_out_room,
    "street": facility.lay_out_track,
    "yard": yard.lay_out_yard,
}

# Those that are closed on all sides.
INDOORS = frozenset({"garage", "room"})
