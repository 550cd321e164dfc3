"""The model that comes with derain: its file, its card, and whether the one is the other's."""

from derain.default.model_card import ModelCard as ModelCard
from derain.default.model_card import ModelScore as ModelScore
from derain.default.packaged_model import DEFAULT as DEFAULT
from derain.default.packaged_model import default_checkpoint as default_checkpoint
from derain.default.packaged_model import default_model as default_model
from derain.default.packaged_model import model_card as model_card
