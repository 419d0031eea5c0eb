"""The parameters of all stages, gathered."""

from __future__ import annotations

from dataclasses import dataclass, field

from fpmatch.image.binarize import BinarizationParameters
from fpmatch.image.blend import BlendParameters
from fpmatch.image.enhance import EnhancementParameters
from fpmatch.image.foreground import ForegroundParameters
from fpmatch.image.frequency import PeriodParameters
from fpmatch.image.normalize import NormalizationParameters
from fpmatch.image.orientation import OrientationParameters
from fpmatch.image.quality import QualityParameters
from fpmatch.image.segment import SegmentationParameters
from fpmatch.image.spectrum import SpectrumParameters
from fpmatch.image.spurious import SpuriousParameters


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
