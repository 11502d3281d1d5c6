# SPDX-License-Identifier: BSD-3-Clause
"""Tests on several ranks: a test file starts itself under mpiexec, and each rank leaves what it has to tell of each case.

    if mpi_ranks.is_rank():
        mpi_ranks.tell(lambda case, rank: {...})
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

FOLDER, CASES = "ECHORAMA_RANKS_FOLDER", "ECHORAMA_RANKS_CASES"


def run(file, cases, ranks):
    """The finished mpiexec, and what each rank has told: {case: ...}. Those that died are missing."""
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ, **{CASES: json.dumps(cases), FOLDER: folder}, OMPI_ALLOW_RUN_AS_ROOT="1",
                           OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_rmaps_base_oversubscribe="1",
                           PRTE_MCA_rmaps_default_mapping_policy=":oversubscribe")  # the same for Open MPI 5
        command = ["mpiexec", "-n", str(ranks), sys.executable, os.path.abspath(file)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
        return done, [json.loads(path.read_text()) for path in sorted(pathlib.Path(folder).iterdir())]


def told(test, file, cases, ranks):
    """What each rank has told, after a run that went well."""
    done, all_ranks = run(file, cases, ranks)
    test.assertEqual(done.returncode, 0, done.stdout + done.stderr)
    test.assertEqual(len(all_ranks), ranks)
    return all_ranks


def is_rank():
    return FOLDER in os.environ


def tell(case_of):
    """Does every case on this rank, and ends."""
    import mpi4py.MPI  # begins MPI
    from vtkmodules.vtkParallelCore import vtkMultiProcessController
    from vtkmodules.vtkParallelMPI import vtkMPIController

    controller = vtkMPIController()
    controller.Initialize()
    vtkMultiProcessController.SetGlobalController(controller)
    rank = controller.GetLocalProcessId()
    all_cases = {case: case_of(case, rank) for case in json.loads(os.environ[CASES])}
    pathlib.Path(os.environ[FOLDER], f"{rank}.json").write_text(json.dumps(all_cases))
    vtkMultiProcessController.SetGlobalController(None)
    sys.exit(0)


def errors_of(algorithm):
    """The messages of its error events, as they come."""
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    algorithm.AddObserver("ErrorEvent", note)
    return messages
