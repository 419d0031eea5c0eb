"""What follows a gallery by its revisions has its entries and fingers, whoever changes it."""

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from made_prints import entry_of, scattered

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label

TEMPLATE = scattered(1, 5)


class Follower:
    """The fingers of a gallery by the numbers of its entries, kept by its changes only."""

    def __init__(self, gallery):
        self.revision = gallery.revision()
        self.fingers = gallery.fingers(after=0)

    def follow(self, gallery):
        """Take the changes since the last time into account."""
        now = gallery.revision()
        removals = gallery.removals_since(self.revision)
        assert removals is not None
        for removal in removals:
            self.fingers.pop(removal.entry, None)
            for number, finger in self.fingers.items():
                if finger == removal.entry:
                    assert removal.finger is not None
                    self.fingers[number] = removal.finger
        self.fingers |= gallery.fingers(after=self.revision.last)
        self.revision = now


def enrol(gallery, number, subject="ada", finger=""):
    label = Label(subject, finger, str(number))
    assert gallery.add([entry_of(number, TEMPLATE, label)]) == [None]


def test_changes_are_known_on_either_database(where):
    with open_gallery(where, create=True) as gallery:
        follower = Follower(gallery)
        assert follower.revision.last == follower.revision.removals == 0
        for number in range(1, 7):
            enrol(gallery, number, subject=f"s{number % 2}")
        follower.follow(gallery)
        assert follower.fingers == gallery.fingers() == {1: 1, 2: 2, 3: 1, 4: 2, 5: 1, 6: 2}
        hashes = {gallery.content_hash()}
        gallery.remove([1, 3, 6])
        enrol(gallery, 7, subject="s1")
        hashes.add(gallery.content_hash())
        follower.follow(gallery)
        assert follower.fingers == gallery.fingers() == {2: 2, 4: 2, 5: 5, 7: 5}
        gallery.remove([5, 7])
        enrol(gallery, 8, subject="s1")
        hashes.add(gallery.content_hash())
        follower.follow(gallery)
        assert follower.fingers == gallery.fingers() == {2: 2, 4: 2, 8: 8}
        assert gallery.removals_since(gallery.revision()) == []
        assert len(hashes) == 3


CHANGES = st.lists(
    st.one_of(
        st.tuples(st.just("add"), st.integers(0, 2), st.integers(0, 1)),
        st.tuples(st.just("remove"), st.integers(0, 30), st.integers(0, 1)),
        st.tuples(st.just("follow"), st.just(0), st.just(0)),
    ),
    max_size=20,
)


@settings(max_examples=25, deadline=None)
@given(CHANGES)
def test_a_follower_has_what_the_gallery_has(changes):
    with (
        tempfile.TemporaryDirectory() as folder,
        open_gallery(Path(folder, "g.db"), create=True) as gallery,
    ):
        follower = Follower(gallery)
        for serial, (kind, one, other) in enumerate(changes, start=1):
            if kind == "add":
                enrol(gallery, serial, f"s{one}", "left" * other)
            elif kind == "remove" and (numbers := list(gallery.fingers())):
                gallery.remove([numbers[one % len(numbers)]])
            elif kind == "follow":
                follower.follow(gallery)
        follower.follow(gallery)
        assert follower.fingers == gallery.fingers() == gallery.fingers(after=0)
