"""Run docs/jupyter.ipynb, and store it with its outputs: `make notebook`.

    python docs/run_jupyter.py [FILE]

The state of widgets is not stored. A page without a kernel cannot use it, and it is as large as the
images.
"""

import sys
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).with_name("jupyter.ipynb")


def run(path: Path) -> Any:
    """Return the notebook with the outputs of this version.

    Raises nbclient's CellExecutionError if a cell fails.
    """
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=300, kernel_name="python3", store_widget_state=False)
    client.extra_arguments = ["--IPKernelApp.log_level=ERROR"]
    client.execute(cwd=str(path.parent))
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # removes the times at which the cell ran
        for output in cell.get("outputs", ()):
            widget = output.get("data", {}).get("application/vnd.jupyter.widget-view+json")
            if widget:
                widget["model_id"] = "none"  # the model belonged to a kernel that has ended
    notebook.metadata.pop("widgets", None)
    return notebook


if __name__ == "__main__":
    place = Path(sys.argv[1]) if len(sys.argv) > 1 else NOTEBOOK
    nbformat.write(run(NOTEBOOK), place)
