"""The command ``attack-server``."""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click
import numpy as np

from research.attacks.attackers import Attackers
from research.attacks.hanging import HangingDatabase, HangingFile
from research.attacks.kinds import ATTACKS
from research.attacks.requests import KINDS, OF_GALLERY, OrdinaryClient, Times
from research.attacks.server import Memory, Server, enrol_samples, started
from research.commands import Command, json_file, print_and_write
from research.tables.serving import OTHER_SERVERS, format_attacks

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager

    from research.attacks.kinds import Attack

SAME: Final = "127.0.0.1"  # the address of the ordinary client
OTHER: Final = "127.0.0.2"
SLOWER: Final = 2.0  # targets: times of ordinary clients against the usual ones
BRIEF_MS: Final = 50.0  # what takes no longer than this is not slow
MEMORY_MB: Final = 50.0
LOG_BYTES: Final = 1_000_000


@dataclass(frozen=True)
class Outcome:
    """The effect of an attack on ordinary clients, and on the server."""

    attack: str
    source: str
    median_ms: dict[str, float]
    p95_ms: dict[str, float]
    requests: int
    refused: int
    wrong: int
    memory_before_mb: float
    memory_most_mb: float
    log_bytes: int
    fates: dict[str, int]
    missed: list[str]


@click.command(
    cls=Command,
    epilog="""\b
Examples:
  python -m research attack-server
  python -m research attack-server --attack "slow uploads" --from 127.0.0.1 --seconds 30
  python -m research attack-server --hangs --database postgresql://ada@localhost/empty
""",
)
@click.option("--seconds", default=15.0, show_default=True, help="Of each attack.")
@click.option("--attack", "names", multiple=True, help="Only this attack (repeatable).")
@click.option("--main", "only_main", is_flag=True, help="Only the three attacks with a target.")
@click.option("--hangs", "only_hangs", is_flag=True, help="Only while the gallery hangs.")
@click.option(
    "--database",
    metavar="URL",
    help="Empty PostgreSQL database for the gallery, reached through a proxy that can hang.  "
    "[default: a file that another program can hold]",
)
@click.option(
    "--from",
    "sources",
    multiple=True,
    default=(SAME, OTHER),
    show_default=True,
    help="Address of the attackers (repeatable); the ordinary client has 127.0.0.1.",
)
@click.option(
    "--open-files", default=1024, show_default=True, help="Limit of open files of the server."
)
@click.option(
    "--server",
    "other",
    type=click.Choice(OTHER_SERVERS),
    help="Run the application by this server, without what `fpmatch serve` adds to it.",
)
@json_file
@click.pass_context
def command(
    context: click.Context,
    seconds: float,
    names: tuple[str, ...],
    only_main: bool,
    only_hangs: bool,
    database: str | None,
    sources: tuple[str, ...],
    open_files: int,
    other: str | None,
    json_file: Path | None,
) -> None:
    """Attack a server in several ways, and measure what its ordinary clients notice.

    A gallery of the sample prints is served. An ordinary client requests health, readiness, a
    verification and an identification in turn, first alone, then beside each attack. Exit status 1
    where answers took more than twice the usual time (median or 95th percentile, and more than 50
    ms), were refused or wrong, where the server took 50 MB more, or its log grew by 1 MB. While the
    gallery hangs, readiness and identification are right when they are refused within two seconds.
    """
    known = [attack.name for attack in ATTACKS]
    if unknown := set(names) - set(known):
        raise click.BadParameter(f"{min(unknown)!r} is none of {', '.join(known)}")
    chosen = [
        attack
        for attack in ATTACKS
        if (not names or attack.name in names)
        and (attack.main or not only_main)
        and (attack.hangs or not only_hangs)
    ]
    words = [sys.executable, "-m"]
    words += ["research.attacks.other_servers", other] if other else ["fpmatch", "serve"]
    words += [] if other else ["--port", "0", "--workers", "2"]
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        file, log = Path(folder) / "prints.db", Path(folder) / "log.txt"
        gallery = HangingDatabase(database) if database else HangingFile(file)
        enrol_samples(gallery.place)
        words += ["--gallery", gallery.place]
        with started(words, log, open_files=open_files) as server:
            client = OrdinaryClient(*server.place)
            usual = _warm_up(client, server, seconds)
            outcomes = [_usual_outcome(usual, server)]
            click.echo(_row(outcomes[0]), err=True)
            for attack in chosen:
                for source in sources:
                    hangs = gallery.hangs() if attack.hangs else nullcontext()
                    outcome = _attack(attack, source, seconds, client, server, outcomes[0], hangs)
                    outcomes.append(outcome)
                    click.echo(_row(outcome), err=True)
    documents = [asdict(outcome) for outcome in outcomes]
    print_and_write(format_attacks(documents), documents, json_file)
    context.exit(1 if any(outcome.missed for outcome in outcomes) else 0)


def _row(outcome: Outcome) -> str:
    """Return what became of the connections of an attack, and the targets that are missed."""
    fates = ", ".join(f"{number} {fate}" for fate, number in list(outcome.fates.items())[:3])
    missed = f"; missed: {', '.join(outcome.missed)}" if outcome.missed else ""
    return f"{outcome.attack}, from {outcome.source}: {fates or '-'}{missed}"


def _warm_up(client: OrdinaryClient, server: Server, seconds: float) -> Times:
    """Let every worker do everything once, then return the usual times."""
    unread = next(attack for attack in ATTACKS if not attack.reads)
    few = replace(unread, connections=4, reads=True)
    attackers = Attackers(few, server.place, SAME)
    attackers.start()
    client.ask_for(seconds / 2)
    attackers.stop()
    return client.ask_for(seconds)


def _usual_outcome(times: Times, server: Server) -> Outcome:
    memory = Memory(server.pid)
    return _outcome("none", SAME, times, memory, 0, Counter(), [])


def _attack(
    attack: Attack,
    source: str,
    seconds: float,
    client: OrdinaryClient,
    server: Server,
    usual: Outcome,
    hangs: AbstractContextManager[None],
) -> Outcome:
    written = server.log.stat().st_size
    attackers = Attackers(attack, server.place, source)
    with Memory(server.pid) as memory:
        attackers.start()
        with hangs:  # while requests are under way
            times = client.ask_for(seconds, hangs=attack.hangs)
            fates = attackers.stop()
    written = server.log.stat().st_size - written
    outcome = _outcome(attack.name, source, times, memory, written, fates, [])
    kinds = [kind for kind in KINDS if not (attack.hangs and kind in OF_GALLERY)]
    outcome.missed.extend(_missed(outcome, usual, kinds))
    return outcome


def _outcome(
    name: str,
    source: str,
    times: Times,
    memory: Memory,
    written: int,
    fates: Counter[str],
    missed: list[str],
) -> Outcome:
    median, p95 = (
        {kind: round(1000 * float(np.percentile(times.seconds[kind], q)), 1) for kind in KINDS}
        for q in (50, 95)
    )
    return Outcome(
        attack=name,
        source=source,
        median_ms=median,
        p95_ms=p95,
        requests=sum(map(len, times.seconds.values())),
        refused=times.refused,
        wrong=times.wrong,
        memory_before_mb=round(memory.before, 1),
        memory_most_mb=round(memory.most, 1),
        log_bytes=written,
        fates=dict(fates.most_common()),
        missed=missed,
    )


def _missed(outcome: Outcome, usual: Outcome, kinds: Sequence[str] = KINDS) -> list[str]:
    """Return the targets that an attack has made the server miss, times of these kinds."""
    slow = [
        f"{what} of {kind}"
        for what in ("median_ms", "p95_ms")
        for kind in kinds
        if getattr(outcome, what)[kind] > max(BRIEF_MS, SLOWER * getattr(usual, what)[kind])
    ]
    grown = outcome.memory_most_mb - outcome.memory_before_mb
    reached = {
        "refused": outcome.refused > 0,
        "wrong": outcome.wrong > 0,
        "memory": grown > MEMORY_MB,
        "log": outcome.log_bytes > LOG_BYTES,
    }
    return slow + [name for name, missed in reached.items() if missed]
