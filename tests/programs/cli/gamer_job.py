"""A gamer program at work, for tests that interrupt it."""

import contextlib
import os
import pathlib
import signal
import subprocess
import time

from gamer_program import ENVIRONMENT, command

# Seconds within which a job must end, even on a busy machine.
PATIENCE = 30


def children(process):
    with contextlib.suppress(OSError):
        return [int(word) for word in
                pathlib.Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    return []


def rank_of(process):
    with contextlib.suppress(OSError):
        for word in pathlib.Path(f"/proc/{process}/environ").read_bytes().split(b"\0"):
            if word.startswith(b"OMPI_COMM_WORLD_RANK="):
                return int(word.split(b"=")[1])
    return None


def size_of(file):
    """The file's size in bytes, or 0 if there is no file."""
    with contextlib.suppress(OSError):
        return file.stat().st_size
    return 0


def is_running(process):
    with contextlib.suppress(OSError):
        # Orphans that no process waits for remain zombies, with one thread when all have ended.
        fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(") ", 1)[1].split()
        state, threads = fields[0], int(fields[17])
        return state != "Z" or threads > 1
    return False


class Job:
    """A run of the program in a folder."""

    def __init__(self, folder, *arguments, ranks=1, limit=None):
        self.folder, self.ranks = folder, ranks
        self.process = subprocess.Popen(command(*arguments, ranks=ranks), cwd=folder.path,
                                        env=ENVIRONMENT, text=True, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, preexec_fn=limit)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Kills the processes that still run."""
        ranks = self.processes()
        if self.process.poll() is None:
            for process in ranks:
                with contextlib.suppress(OSError):
                    os.kill(process, signal.SIGKILL)
        self.process.kill()
        self.process.communicate()
        self.wait_for_ranks_to_end(ranks)

    def processes(self):
        """The processes of the ranks that have started, in order of rank."""
        if self.ranks == 1:
            return [self.process.pid]
        found = {rank_of(child): child for child in children(self.process.pid)}
        return [found[rank] for rank in sorted(found.keys() - {None})]

    def wait_until(self, condition):
        """Waits until the condition holds or the job has ended."""
        while self.process.poll() is None and not condition():
            time.sleep(0.002)

    def wait_for_journal(self, bytes_in_it=0, name="out.fits"):
        """Waits until the journal holds more than so many bytes or the job has ended."""
        journal = self.folder.path / f"{name}.journal"
        self.wait_until(lambda: size_of(journal) > bytes_in_it)

    def end(self):
        """The exit code, standard output, standard error, and the seconds until the end."""
        start = time.monotonic()
        try:
            said = self.process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            # Open MPI's launcher 4.1.4 sometimes hangs in pmix_rte_finalize after its ranks have
            # ended.
            if self.ranks == 1 or any(map(is_running, self.processes())):
                raise
            self.process.kill()
            said = self.process.communicate()
        return self.process.returncode, *said, time.monotonic() - start

    def wait_for_ranks_to_end(self, ranks):
        end = time.monotonic() + PATIENCE
        while any(map(is_running, ranks)):
            assert time.monotonic() < end, "a rank is still there"
            time.sleep(0.002)
