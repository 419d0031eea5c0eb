"""Commands of galleries and batches: enrol, identify, gallery, score."""
