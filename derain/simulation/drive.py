"""What moves while a sequence is recorded: the vehicle that carries the sensor, and others."""

from dataclasses import dataclass

from derain.errors import InputError
from derain.files.documents import shown

# Fastest vehicle, m/s: 216 km/h.
FASTEST = 60.0

# Most things that move. A street has room for 25 or more within sight of a sensor that stands.
MOST_TRAFFIC = 20

# Longest drive, metres: its street has one and a half million triangles and is laid out in 10 s.
LONGEST = 2000.0


@dataclass(frozen=True)
class Drive:
    """A drive along a street, or a stand in it while others move.

    Attributes:
        speed: Speed of the sensor along the street, m/s; 0 stands.
        traffic: How many cars and pedestrians move, each at a speed of its own.
        skew: Whether every beam sees the scene as it is when that beam is sent, so that a scan is
            skewed by what moves while it is taken; else all of a scan is seen as it is when the
            scan begins, as after a perfect correction.

    Raises:
        InputError: A speed or a number that is impossible, or skew where nothing moves.
    """

    speed: float = 0.0
    traffic: int = 0
    skew: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.speed <= FASTEST:
            raise InputError(
                "speed",
                f"{shown(self.speed)} m/s is impossible",
                f"Give 0 (stands) to {FASTEST:g}.",
            )
        if not 0 <= self.traffic <= MOST_TRAFFIC:
            raise InputError(
                "traffic", f"{shown(self.traffic)} is impossible", f"Give 0 to {MOST_TRAFFIC}."
            )
        if self.skew and not (self.speed or self.traffic):
            raise InputError(
                "skew", "there is none where nothing moves", "Give a speed or traffic."
            )

    def length(self, duration: float) -> float:
        """Length of the drive in metres.

        Args:
            duration: How long it takes, seconds.

        Raises:
            InputError: Too long a drive.
        """
        length = self.speed * duration
        if length > LONGEST:
            raise InputError(
                "drive",
                f"{duration:,.0f} s at {self.speed:g} m/s are {length:,.0f} m of street, more "
                f"than {LONGEST:,.0f}",
                "Simulate more sequences of fewer scans.",
            )
        return length
