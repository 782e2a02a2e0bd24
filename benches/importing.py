"""What `import plantune` costs over `import numpy`, in fresh interpreters."""

import subprocess
import sys
from statistics import median

from benches.frame import Bench, Contestant

# Stages load when first used, and numpy with them: so numpy is there in all that is compared.
OURS = "import numpy, plantune"
USED = "import plantune as p; p.Record, p.estimate.arx, p.tune.imc_pi"
PEERS = ("import numpy", USED, "import plantune", "pass")


def contestant(code):
    def job():
        subprocess.run([sys.executable, "-c", code], check=True)

    return Contestant(code, lambda: job)


def over_numpy(rows):
    cpu = {row["name"]: row["cpu"] for row in rows}

    def over(code):
        pairs = zip(cpu[code], cpu["import numpy"], strict=True)
        return f"{1e3 * median(ours - numpy for ours, numpy in pairs):+.1f} ms"

    return (
        f"CPU time over numpy's: {over(OURS)}; with the stages for a model and its PI, {over(USED)}"
    )


BENCHES = [
    Bench(
        "Import, a fresh interpreter each time",
        [contestant(code) for code in (OURS, *PEERS)],
        difference=None,
        memory=False,
        patience=8.0,
        remark=over_numpy,
    )
]
