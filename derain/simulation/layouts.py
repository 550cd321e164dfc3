"""The kinds of places that a sequence may be simulated in, by the names that users type."""

from collections.abc import Callable

from numpy.random import Generator

from derain.simulation.facility import lay_out_facility
from derain.simulation.layout import lay_out_track
from derain.simulation.places.car_park import lay_out_car_park
from derain.simulation.places.city import lay_out_city
from derain.simulation.places.country import lay_out_country
from derain.simulation.places.garage import lay_out_garage
from derain.simulation.places.motorway import lay_out_motorway
from derain.simulation.places.room import lay_out_room
from derain.simulation.places.yard import lay_out_yard
from derain.simulation.track import Track

# Each lays out another place of its kind for every state of the generator. The origin of the track
# is on the ground under the sensor.
LAYOUTS: dict[str, Callable[[Generator], Track]] = {
    "car_park": lay_out_car_park,
    "city": lay_out_city,
    "country": lay_out_country,
    "facility": lay_out_facility,
    "garage": lay_out_garage,
    "motorway": lay_out_motorway,
    "room": lay_out_room,
    "street": lay_out_track,
    "yard": lay_out_yard,
}

# Those that are closed on all sides.
INDOORS = frozenset({"garage", "room"})
