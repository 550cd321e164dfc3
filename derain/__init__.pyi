"""What ``import derain`` offers: one line a name, which is all that it takes to offer another.

:mod:`derain` reads this file to find out where a name comes from, and type checkers and editors
read it to know what it is.
"""

from derain.cards.card import DataCard as DataCard
from derain.cards.card import load_card as load_card
from derain.datamodules.folder import Folder as Folder
from derain.datamodules.in_memory import InMemory as InMemory
from derain.datamodules.mixture import Mixture as Mixture
from derain.datamodules.rehearse3d import Rehearse3D as Rehearse3D
from derain.datamodules.sequences import Sequences as Sequences
from derain.datamodules.simulated import Simulated as Simulated
from derain.datamodules.taught import Taught as Taught
from derain.datamodules.wads import Wads as Wads
from derain.datamodules.worlds import Worlds as Worlds
from derain.errors import InputError as InputError
from derain.errors import ScanWarning as ScanWarning
from derain.example import example_scan as example_scan
from derain.export.bench.bench import bench as bench
from derain.export.recorded import RecordedDerainer as RecordedDerainer
from derain.export.runtime import Derainer as Derainer
from derain.files import read_scan as read_scan
from derain.files import write_scan as write_scan
from derain.filters import CRF as CRF
from derain.filters import DROR as DROR
from derain.filters import DSOR as DSOR
from derain.filters import ROR as ROR
from derain.filters import SOR as SOR
from derain.filters import SSR as SSR
from derain.filters import FilterDerainer as FilterDerainer
from derain.models.checkpoint import load_model as load_model
from derain.models.cues import CueFusion as CueFusion
from derain.models.cues import CueNetwork as CueNetwork
from derain.models.lisnownet import LiSnowNet as LiSnowNet
from derain.models.lisnownet import LiSnowNetwork as LiSnowNetwork
from derain.models.outdet import OutDet as OutDet
from derain.models.outdet import OutDetNetwork as OutDetNetwork
from derain.models.salsanext import SalsaNext as SalsaNext
from derain.models.salsanext import SalsaNextNetwork as SalsaNextNetwork
from derain.models.salsanext_lite import SalsaNextLite as SalsaNextLite
from derain.models.salsanext_lite import SalsaNextLiteNetwork as SalsaNextLiteNetwork
from derain.recordings.odometry import Odometry as Odometry
from derain.recordings.persistence import Persistence as Persistence
from derain.recordings.persistence import PersistenceDerainer as PersistenceDerainer
from derain.scan import Scan as Scan
from derain.sources.clean_sink import CleanSink as CleanSink
from derain.sources.cleaning import CleanReport as CleanReport
from derain.sources.cleaning import clean as clean
from derain.sources.folders import named_frames as named_frames
from derain.sources.source import Frames as Frames
from derain.sources.units import Division as Division
from derain.sources.weather_monitor import WeatherOptions as WeatherOptions
from derain.system.memory import keep_freed_memory as keep_freed_memory
from derain.weather.alarm import Alarm as Alarm
from derain.weather.alarm import Threshold as Threshold
from derain.weather.scan_weather import ScanWeather as ScanWeather
from derain.workflows.fit import fit as fit
from derain.workflows.learn import learn as learn
from derain.workflows.learn_config import LearnConfig as LearnConfig

__version__: str
