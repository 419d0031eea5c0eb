"""The parameters of all stages, gathered."""

from __future__ import annotations

from dataclasses import dataclass, field

from fpmatch.image.enhancement.blend import BlendParameters
from fpmatch.image.enhancement.gabor import EnhancementParameters
from fpmatch.image.enhancement.orientation import OrientationParameters
from fpmatch.image.enhancement.ridge_period import PeriodParameters
from fpmatch.image.enhancement.spectrum import SpectrumParameters
from fpmatch.image.preprocess.foreground import ForegroundParameters
from fpmatch.image.preprocess.normalize import NormalizationParameters
from fpmatch.image.preprocess.segment import SegmentationParameters
from fpmatch.image.skeleton.binarize import BinarizationParameters
from fpmatch.image.skeleton.minutia_quality import QualityParameters
from fpmatch.image.skeleton.spurious import SpuriousParameters


@dataclass(frozen=True, slots=True)
class ExtractionParameters:
    """Gather the parameters of every stage; lengths in pixels at 500 dpi.

    Spectrum, period, enhancement and blend serve the oriented filters alone.
    """

    foreground: ForegroundParameters = field(default_factory=ForegroundParameters)
    normalization: NormalizationParameters = field(default_factory=NormalizationParameters)
    spectrum: SpectrumParameters = field(default_factory=SpectrumParameters)
    segmentation: SegmentationParameters = field(default_factory=SegmentationParameters)
    orientation: OrientationParameters = field(default_factory=OrientationParameters)
    period: PeriodParameters = field(default_factory=PeriodParameters)
    enhancement: EnhancementParameters = field(default_factory=EnhancementParameters)
    blend: BlendParameters = field(default_factory=BlendParameters)
    binarization: BinarizationParameters = field(default_factory=BinarizationParameters)
    spurious: SpuriousParameters = field(default_factory=SpuriousParameters)
    quality: QualityParameters = field(default_factory=QualityParameters)
