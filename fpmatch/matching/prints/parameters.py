"""Names of the parameters until kernels, reference and tests have the flat ones."""

from fpmatch.matching.parameters import MatchParameters

PreparationParameters = NeighbourhoodParameters = BitDescriptorParameters = MatchParameters
