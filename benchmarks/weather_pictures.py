"""Pictures of the weather: where it rains around the sensor, and how far one sees."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from derain.pictures.palette import LINES
from derain.pictures.scan_pictures import save
from derain.weather.alarm import ERROR, WARNING, Alarm, Level
from derain.weather.scan_weather import RANGE_BANDS, ScanWeather
from derain.weather.visibility import Visibility

# Of what nothing is known, which looks like no share of the scale.
NOT_KNOWN = {"facecolor": "#e6e6e6", "hatch": "////", "edgecolor": "#9a9a9a"}
SHADES = "Blues"

# Behind a line, by the level at the time.
LEVELS = {Level.CLEAR: "#ffffff", Level.WARNING: "#ffe9b3", Level.ERROR: "#ffc9c2"}

# Visibility in the same scans, by labels and by the model.
ByBoth = Sequence[tuple[Visibility, Visibility]]


def draw_rose(weather: ScanWeather, path: Path) -> None:
    """Draws the shares of rain by sector and range, the sensor in the middle and ahead up."""
    figure = Figure(figsize=(6.4, 5.6), layout="constrained")
    axes = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    axes.patch.set(**NOT_KNOWN)  # it is seen wherever nothing is drawn
    # A sector is drawn as thirty slices, which look round; rings of equal width, for most rain is
    # near by.
    turn = np.radians(np.arange(361) - 15)
    shares = np.repeat(100 * weather.shares.T, 30, axis=1)
    drawn = axes.pcolormesh(
        turn, np.arange(len(RANGE_BANDS) + 1), shares, cmap=SHADES, vmin=0, vmax=100
    )
    axes.grid(visible=False)
    for edge in np.radians(30 * np.arange(12) + 15):
        axes.plot([edge, edge], [0, len(RANGE_BANDS)], color="0.7", linewidth=0.6)
    for ring in range(1, len(RANGE_BANDS)):
        axes.plot(turn, np.full(len(turn), ring), color="0.7", linewidth=0.6)
        axes.text(
            np.radians(-15), ring, f"{RANGE_BANDS[ring]} m", fontsize=8, ha="center", va="center"
        ).set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1, "alpha": 0.8})
    axes.set_yticks([])
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["ahead", "left", "behind", "right"])
    axes.set_title(f"Rays that end at snow; 90 % get through {weather.visibility}")
    figure.colorbar(drawn, ax=axes, label="share of the rays that end there, %", shrink=0.8)
    not_known = Patch(label="no ray ends there: not known", **NOT_KNOWN)
    figure.legend(handles=[not_known], loc="outside lower center", frameon=False)
    save(figure, path)


def draw_visibility(
    places: Mapping[str, ByBoth], rates: Sequence[float], drive: ByBoth, path: Path
) -> None:
    """Draws visibility by the rate of rain, and over a drive with the level of the default alarm.

    Args:
        places: Visibility at a place at each of the rates, by its name.
        rates: Rates of rain, mm/h, rising.
        drive: Visibility in the scans of a drive, in order.
        path: Picture to write.
    """
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    by_rate, over_drive = figure.subplots(1, 2)
    for (name, visibilities), colour in zip(places.items(), LINES, strict=False):
        _draw_both(by_rate, rates, visibilities, colour, name)
    by_rate.set_xscale("log")
    by_rate.set_yscale("log")
    by_rate.set_xticks(rates, [f"{rate:g}" for rate in rates])
    by_rate.minorticks_off()
    metres = (5, 10, 20, 50, 100, 200)
    by_rate.set_yticks(metres, [f"{number}" for number in metres])
    by_rate.set(title="simulated rain", xlabel="mm/h", ylabel="visibility, m")
    scans, alarm = np.arange(1, len(drive) + 1), Alarm()
    for scan, (_, by_model) in zip(scans, drive, strict=True):
        colour = LEVELS[alarm.update(by_model)]
        over_drive.axvspan(scan - 0.5, scan + 0.5, color=colour, linewidth=0)
    _draw_both(over_drive, scans, drive, LINES[4], "snow")
    for threshold, colour in ((WARNING, "#d98200"), (ERROR, "#c53030")):
        over_drive.axhline(threshold.below, color=colour, linewidth=1)
        over_drive.axhline(threshold.above, color=colour, linewidth=1, linestyle="--")
    over_drive.set(title="a drive in snow, and the level of the default alarm", xlabel="scan")
    over_drive.set_ylim(0, 1.5 * WARNING.above)  # the legend has its place above
    over_drive.set_xlim(0.5, len(drive) + 0.5)
    over_drive.set_xticks(scans[::2] + 1)
    for axes in (by_rate, over_drive):
        axes.grid(alpha=0.25)
    by_rate.plot([], [], color="0.3", linestyle=":", label="by the true labels")
    by_rate.plot([], [], color="0.3", marker=".", label="by the default model")
    by_rate.legend(fontsize=8)
    levels = [Patch(facecolor=LEVELS[level], edgecolor="0.7", label=str(level)) for level in LEVELS]
    begins = Line2D([], [], color="0.3", linewidth=1, label="a level begins below")
    ends = Line2D([], [], color="0.3", linewidth=1, linestyle="--", label="a level ends above")
    over_drive.legend(handles=[*levels, begins, ends], fontsize=8, loc="upper left", ncols=2)
    save(figure, path)


def _draw_both(
    axes: Axes, places: Sequence[float], visibilities: ByBoth, colour: str, label: str
) -> None:
    labels, model = np.array([[one.shown, other.shown] for one, other in visibilities]).T
    axes.plot(places, labels, color=colour, linestyle=":")
    axes.plot(places, model, color=colour, marker=".", label=label)
