"""From the enhanced image to minutiae: binarize, thin, crossing number, spurious minutiae."""
