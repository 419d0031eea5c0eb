"""What follows a gallery by its revisions has its entries and fingers, whoever changes it."""

import hashlib
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa
from hypothesis import given, settings
from hypothesis import strategies as st
from made_prints import changed, entry_of, scattered

from fpmatch.errors import GalleryError
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.history import UNKNOWN

TEMPLATE = scattered(1, 5)
TABLES = ("TABLE fpmatch_state", "TABLE fpmatch_removal")
OTHERS = ("insert", "update", "removal", "state")  # what history has triggers for


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


def without_history(path):
    """Make a gallery as version 0.2 made it."""
    for what in (*(f"TRIGGER fpmatch_history_{name}" for name in OTHERS), *TABLES):
        changed(path, f"DROP {what}")


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


def test_a_gallery_of_an_earlier_version_gets_a_history_with_its_next_change(tmp_path):
    path = tmp_path / "g.db"
    with open_gallery(path, create=True) as gallery:
        enrol(gallery, 1)
        enrol(gallery, 2)
    without_history(path)
    with open_gallery(path) as gallery:
        before, content = gallery.revision(), gallery.content_hash()
        assert before.removals == UNKNOWN
        assert gallery.removals_since(before) == []
        ((state,),) = changed(path, "SELECT state FROM fpmatch_gallery")
        # the hash of version 0.2, which is in the names of its prepared prints
        assert content == hashlib.sha256(f"{state} 2 2".encode()).hexdigest()[:32]
        gallery.remove([1])
        assert gallery.removals_since(before) is None
        follower = Follower(gallery)
        assert follower.revision.removals == 1
        enrol(gallery, 3)
        gallery.remove([2])
        follower.follow(gallery)
        assert follower.fingers == {3: 3}


def test_a_change_by_another_program_is_known(tmp_path):
    path = tmp_path / "g.db"
    with open_gallery(path, create=True) as gallery:
        for number in range(1, 5):
            enrol(gallery, number)
        follower, content = Follower(gallery), gallery.content_hash()
        changed(path, "DELETE FROM fpmatch_entry WHERE id = 1")
        follower.follow(gallery)
        assert follower.fingers == {2: 2, 3: 2, 4: 2}
        assert gallery.content_hash() != content


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE fpmatch_entry SET subject = 'bob' WHERE id = 2",
        "UPDATE fpmatch_entry SET id = 9 WHERE id = 2",
        "INSERT INTO fpmatch_entry SELECT 1, 'bob', '', '', source, zeroblob(32), dpi, minutiae, "
        "digest, template FROM fpmatch_entry WHERE id = 2",
    ],
)
def test_after_a_change_that_fpmatch_never_makes_nothing_is_known(statement, where):
    if "zeroblob" in statement and where.startswith("postgresql"):
        statement = statement.replace("zeroblob(32)", "decode('00', 'hex')")
    with open_gallery(where, create=True) as gallery:
        for number in range(1, 4):
            enrol(gallery, number)
        gallery.remove([1])
        before, content = gallery.revision(), gallery.content_hash()
        with gallery.writing() as connection:
            connection.exec_driver_sql(statement)
        assert gallery.removals_since(before) is None
        assert gallery.content_hash() != content
        follower = Follower(gallery)
        gallery.remove([3])
        follower.follow(gallery)
        assert follower.fingers == gallery.fingers()


def test_the_changes_of_a_restored_copy_are_not_known(tmp_path):
    path, backup = tmp_path / "g.db", tmp_path / "backup.db"
    with open_gallery(path, create=True) as gallery:
        enrol(gallery, 1)
        follower = Follower(gallery)
        shutil.copy(path, backup)
        enrol(gallery, 2)
        late = gallery.revision()
    shutil.copy(backup, path)
    with open_gallery(path) as gallery:
        assert gallery.removals_since(late) is None
        enrol(gallery, 3)
        assert gallery.revision().last == late.last
        assert gallery.removals_since(late) is None
        follower.follow(gallery)
        assert follower.fingers == gallery.fingers()


def test_who_may_not_create_tables_enrols_without_a_history(where):
    if not where.startswith("postgresql"):
        pytest.skip("SQLite has no roles")
    with open_gallery(where, create=True) as gallery:
        enrol(gallery, 1)
        with gallery.writing() as connection:
            for name in OTHERS:
                connection.exec_driver_sql(f"DROP FUNCTION fpmatch_history_{name} CASCADE")
            connection.exec_driver_sql("DROP TABLE fpmatch_state, fpmatch_removal")
            role = f"clerk_{np.random.default_rng().integers(10**9)}"
            connection.exec_driver_sql(f"CREATE ROLE {role} LOGIN")
            connection.exec_driver_sql(
                "GRANT SELECT, INSERT, UPDATE, DELETE ON fpmatch_gallery, fpmatch_entry, "
                f"fpmatch_failure TO {role}"
            )
            connection.exec_driver_sql(f"GRANT USAGE ON SEQUENCE fpmatch_entry_id_seq TO {role}")
        as_clerk = where.replace("fpmatch@", f"{role}@")
        with open_gallery(as_clerk) as clerk:
            enrol(clerk, 2)
            assert clerk.revision().removals == UNKNOWN
        enrol(gallery_again := open_gallery(where), 3)  # the owner makes one
        assert gallery_again.revision().removals == 0
        follower = Follower(gallery_again)
        with open_gallery(as_clerk) as clerk:  # who may still enrol and remove
            clerk.remove([1])
            enrol(clerk, 4)
            with pytest.raises(GalleryError), clerk.writing() as connection:
                connection.execute(sa.text("DELETE FROM fpmatch_removal"))
        follower.follow(gallery_again)
        assert follower.fingers == gallery_again.fingers() == {2: 2, 3: 2, 4: 2}
        gallery_again.close()
