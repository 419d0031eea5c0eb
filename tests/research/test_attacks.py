"""`scripts/attack_server`: what its attackers send, and when a target is missed."""

from collections import Counter
from itertools import islice

import pytest

pytest.importorskip("fastapi", reason="the extra `web` is not installed")

from research.attacks.command import BRIEF_MS, Outcome, _missed, _row
from research.attacks.kinds import ATTACKS
from research.attacks.requests import KINDS, OF_GALLERY

FEW = dict.fromkeys(KINDS, 1.0)


def outcome(**parts):
    usual = {
        "attack": "none",
        "source": "127.0.0.1",
        "median_ms": dict.fromkeys(KINDS, 100.0),
        "p95_ms": dict.fromkeys(KINDS, 150.0),
        "requests": 30,
        "refused": 0,
        "wrong": 0,
        "memory_before_mb": 100.0,
        "memory_most_mb": 101.0,
        "log_bytes": 0,
        "fates": dict(Counter({"closed": 3})),
        "missed": [],
    }
    return Outcome(**usual | parts)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.name)
def test_an_attack_sends_bytes(attack):
    parts = list(islice(attack.script(), 3))
    assert all(isinstance(data, bytes) and pause >= 0 for data, pause in parts)
    assert attack.connections * (attack.name != "no byte") == 0 or parts[0][0]


def test_the_three_attacks_with_targets_are_marked():
    assert [attack.name for attack in ATTACKS if attack.main] == [
        "half a header",
        "slow uploads",
        "answers unread",
    ]


@pytest.mark.parametrize(
    ("parts", "missed"),
    [
        ({}, []),
        ({"median_ms": dict.fromkeys(KINDS, 199.0)}, []),
        ({"p95_ms": FEW | {"health": BRIEF_MS, "verify": 301.0}}, ["p95_ms of verify"]),
        ({"refused": 1, "wrong": 2}, ["refused", "wrong"]),
        ({"memory_most_mb": 151.0}, ["memory"]),
        ({"log_bytes": 1_000_001}, ["log"]),
    ],
)
def test_a_target_is_missed_or_held(parts, missed):
    assert _missed(outcome(**parts), outcome()) == missed


def test_while_the_gallery_hangs_only_what_needs_none_must_be_as_quick_as_ever():
    late = outcome(p95_ms=FEW | dict.fromkeys(OF_GALLERY, 5000.0))
    assert _missed(late, outcome()) == [f"p95_ms of {kind}" for kind in OF_GALLERY]
    assert _missed(late, outcome(), [kind for kind in KINDS if kind not in OF_GALLERY]) == []


def test_what_became_of_an_attack_is_told():
    assert "3 closed" in _row(outcome())
    assert _row(outcome(missed=["log"])).endswith("; missed: log")
