"""The objects of the API, as its description shows them."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field


class Error(BaseModel):
    """An error, in one sentence."""

    error: str
    id: str | None = None
    """Where the server is the reason: under what its log has more."""


class Transform(BaseModel):
    """``q = t + s·R(θ)·p`` takes a pixel of the probe to the reference; y points down."""

    scale: float
    rotation_deg: float
    tx: float
    ty: float


class Scale(BaseModel):
    """Ratio of the scales of reference and probe at their resolutions."""

    ratio: float
    error: float
    differs: bool


class QualityReason(BaseModel):
    """A fault of an image, and what to do about it."""

    code: str
    message: str


class Quality(BaseModel):
    """Quality of an image, 0 to 100, and its faults."""

    score: int
    reasons: list[QualityReason]


class Compared(BaseModel):
    """Amount of two prints that was compared."""

    minutiae: int = Field(description="Minutiae of both prints in the common region")
    area_mm2: float = Field(description="Area of the common region")
    ridge_agreement: float | None = Field(
        description="Mean correlation of the ridges, -1 to 1; null where they were not compared"
    )
    ridge_area_mm2: float = Field(description="Area on which the ridges were compared")


Decision = Literal["match", "no match", "inconclusive"]


class PrintResolution(BaseModel):
    """The resolution of a print, and where it comes from."""

    dpi: float
    source: Literal["given", "stated", "found", "assumed"]


class Verified(BaseModel):
    """The decision on two prints, as `fpmatch verify --json` prints it."""

    decision: Decision = Field(description="Inconclusive where the prints lack evidence")
    match: bool = Field(
        description="Whether the score reaches the threshold, or matched_share is more than rho"
    )
    score: float | None = Field(description="-10·log10(FMR), 0 to 100; null if not calibrated")
    fmr: float | None = Field(
        description="Share of pairs of different fingers that score as high; null if identical"
    )
    extrapolated: bool = Field(description="Whether the FMR is smaller than any measured one")
    threshold: float | None = Field(
        description="The least score of a match, or the score that corresponds to rho"
    )
    matched_share: float = Field(description="Pairs over minutiae of the smaller print")
    rho: float | None = Field(description="What matched_share must exceed; null if a score decides")
    matcher: str = Field(description="Matcher, with the parameters that are not the usual ones")
    pairs: int = Field(description="How many minutiae are paired")
    transform: Transform | None = Field(
        description="scale, rotation_deg, tx, ty: takes pixels of the probe to the reference"
    )
    rms_px: float | None = Field(description="Distance of the pairs, in pixels of the reference")
    compared: Compared | None = Field(
        description="How much was compared; null where the matcher does not measure it"
    )
    scale: Scale | None = Field(description="ratio, error, differs: of the reference to the probe")
    identical: Literal["pixels", "template"] | None = Field(
        description="What of the two prints is the same; null where they differ"
    )
    missing: str | None = Field(description="What the prints lack where inconclusive, else null")
    reachable_score: float | None = Field(
        description="Score that half of the genuine pairs of as much evidence reach, if known"
    )
    reason: str = Field(description="What is missing, or why not; empty for a match")
    quality: dict[str, Quality | None] = Field(
        description="Of the pictures of probe and reference; null for a template"
    )
    probe: str = Field(description="Name of the file")
    reference: str = Field(description="Name of the file")
    resolution: dict[str, PrintResolution] = Field(description="Of probe and reference")


class About(BaseModel):
    """Version and limits of this server."""

    version: str
    gallery: str | None
    matchers: list[str]
    role: str = Field(description="of the client that asks: read, verify, enrol or admin")
    file_megabytes: float
    seconds: float


class Health(BaseModel):
    """State of the server, in a word."""

    status: str


class Resolution(BaseModel):
    """Number of impressions of a resolution."""

    dpi: float
    impressions: int


class GalleryInfo(BaseModel):
    """Counts and sizes of a gallery, as `fpmatch gallery list --summary --json` prints them."""

    gallery: str
    version: int
    impressions: int
    subjects: int
    minutiae: int
    template_bytes: int
    dpi: list[Resolution]
    failures: int
    damaged: int = Field(description="entries that cannot be read and are skipped")
    keys: list[str] = Field(description="ids of the keys it is encrypted with; none if it is not")


class FoundCandidate(BaseModel):
    """An enrolled finger that may be the probe's."""

    rank: int
    id: int
    subject: str
    finger: str
    impression: str
    source: str
    score: float
    fmr: float
    extrapolated: bool
    expected_false_matches: float
    impressions: int = Field(description="of the finger, from which its score comes")
    impression_score: float = Field(description="score of the most similar impression alone")
    transform: Transform | None
    pairs: int
    rms_px: float | None


class Identified(BaseModel):
    """The enrolled fingers that match a probe best, best first."""

    gallery: str
    matcher: str
    enrolled: int = Field(description="prints that were searched")
    damaged: int = Field(description="entries that cannot be read and were skipped")
    compared: int = Field(description="prints compared: of a large gallery, those its index chose")
    loss: float | None = Field(description="share of mates the index may miss; null without one")
    passed_on: list[int] = Field(description="prints that each stage of the index passed on")
    probe: str
    notes: list[str]
    seconds: float
    candidates: list[FoundCandidate]


class Enrolled(BaseModel):
    """The outcome of an enrolment."""

    enrolled: bool = Field(description="false where the same file was enrolled before")
    name: str
    subject: str
    finger: str
    impression: str
    minutiae: int
    subject_existed: bool = Field(description="Whether the subject had other prints before")
    unmatched: str | None = Field(
        description="Why the print matches no other of its finger; null where it does"
    )
    notes: list[str]


class EnrolledPrint(BaseModel):
    """An enrolled print, as `fpmatch gallery list --json` prints it."""

    id: int
    subject: str
    finger: str
    impression: str
    source: str
    sha256: str = Field(description="Of the file")
    dpi: float
    minutiae: int


class EnrolledPrints(BaseModel):
    """The enrolled prints of a subject."""

    prints: list[EnrolledPrint]


class Removed(BaseModel):
    """The outcome of a removal."""

    removed: int = Field(description="Number of prints removed")


class BestImpression(BaseModel):
    """The enrolled impression that is most similar to the probe."""

    id: int
    finger: str
    impression: str
    source: str
    score: float


class CheckedClaim(BaseModel):
    """The decision on a claimed identity, as `fpmatch verify --gallery --json` prints it."""

    decision: Decision
    match: bool
    score: float
    fmr: float | None
    extrapolated: bool
    threshold: float
    reason: str
    subject: str
    impressions: int = Field(description="Impressions enrolled")
    compared: int = Field(description="Impressions compared: the 64 most similar at most")
    damaged: int = Field(description="Impressions that cannot be read and were skipped")
    identical: Literal["pixels", "template"] | None = Field(
        description="What of the probe and of `best` is the same; null where they differ"
    )
    best: BestImpression
    notes: list[str]
