"""The report at the end of ``derain test``."""

import json
from pathlib import Path

import lightning
from lightning.pytorch.loggers import TensorBoardLogger

from derain.errors import counted, printable
from derain.evaluation.counts import SCORES, or_none
from derain.evaluation.metrics import RainMetrics
from derain.evaluation.text_tables import number_text
from derain.files.atomic import write_text
from derain.models.base import DerainingModule


class TestReport(lightning.Callback):
    """Prints the scores by average, semantic class and range, and writes them as ``test.json``.

    TensorBoard shows the report, too. One that is in the folder already is replaced.
    """

    __test__ = False  # not a test of pytest's

    def on_test_end(self, trainer: lightning.Trainer, model: DerainingModule) -> None:
        """Prints the report, and writes it beside the run's log where there is one."""
        # Counts and folder are put together by all processes, the report is the first one's.
        text = as_text(model.metrics, model.card.name)
        checkpoint = None if trainer.ckpt_path is None else str(trainer.ckpt_path)
        scores = {"data": model.card.name, "checkpoint": checkpoint, **as_dict(model.metrics)}
        folder = trainer.log_dir if trainer.loggers else None  # not the current folder
        if not trainer.is_global_zero:
            return
        print(text)
        for logger in trainer.loggers:
            if isinstance(logger, TensorBoardLogger):
                as_code = text.replace("\n", "\n    ")  # of Markdown, whose columns line up
                logger.experiment.add_text("test", f"    {as_code}", model.trained_steps)
        if folder is not None:
            path = Path(folder) / "test.json"
            write_text(path, json.dumps(scores, indent=2) + "\n")
            print(printable(f"Written to {path}"))


def as_dict(metrics: RainMetrics) -> dict[str, object]:
    """Scores and counts as JSON-able primitives; a score that is undefined is None."""
    measured = metrics.counts()
    return {
        "scores": {name: or_none(float(score)) for name, score in metrics.compute().items()},
        "scans": len(measured.per_scan),
        "classes": {
            name: {"points": counts.points, "called_rain": counts.called_rain, "rain": counts.rain}
            for name, counts in measured.by_class.items()
        },
        "ranges": {
            name: {score: or_none(getattr(counts, score)) for score in SCORES}
            for name, counts in measured.by_range.items()
        },
    }


def as_text(metrics: RainMetrics, data: str) -> str:
    """Scores and counts as three small tables; ``-`` is a score that is undefined."""
    measured = metrics.counts()
    scores = {name: float(score) for name, score in metrics.compute().items()}
    scans = counted(len(measured.per_scan), "scan")
    lines = [f"{data}, {scans}      precision  recall      F1     IoU"]
    width = lines[0].index("precision")
    for average, suffix in (("pooled over points", ""), ("mean over scans", "_per_scan")):
        lines.append(average.ljust(width) + _row([scores[score + suffix] for score in SCORES]))
    for band, counts in measured.by_range.items():
        lines.append(band.ljust(width) + _row([getattr(counts, score) for score in SCORES]))
    lines += ["", "class".ljust(width) + "   points  called rain   share"]
    for name, of_class in measured.by_class.items():
        if of_class.points:
            name += " (rain)" if of_class.rain else ""
            lines.append(
                f"{name:<{width}}{of_class.points:9,}{of_class.called_rain:13,}"
                f"{of_class.share_lost:8.2%}"
            )
    return "\n".join(lines)


def _row(scores: list[float]) -> str:
    cells = [number_text(score, ".4f") for score in scores]
    return "".join(cell.rjust(width) for cell, width in zip(cells, (9, 8, 8, 8), strict=True))
