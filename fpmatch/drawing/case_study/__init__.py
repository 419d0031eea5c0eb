"""The paper's section 4.1 on two prints: from images to transform, a picture a step."""
