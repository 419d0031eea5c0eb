"""The method step by step on two prints or point sets: `page` writes what the matchers compute."""
