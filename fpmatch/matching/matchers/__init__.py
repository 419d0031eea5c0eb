"""The matchers of this package: one public module each; `fpmatch.matching.registry` finds them."""
