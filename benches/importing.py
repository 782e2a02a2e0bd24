"""What `import plantune` costs over `import numpy`, in fresh interpreters."""

import subprocess
import sys

from benches.frame import Bench, Contestant

# Stages load when first used, and numpy with them: so numpy is there in all that is compared.
OURS = "import numpy, plantune"
USED = "import numpy, plantune as p; p.Record, p.estimate.arx, p.tune.imc_pi"
PEERS = ("import numpy", USED, "import plantune", "pass")


def contestant(code):
    def job():
        subprocess.run([sys.executable, "-c", code], check=True)

    return Contestant(code, lambda: job)


def over_numpy(rows):
    """Differences of the least times: a few ms of 100 drown in what else the machine does."""
    least = {row["name"]: 1e3 * min(row["cpu"]) for row in rows}
    over = {code: f"{least[code] - least['import numpy']:+.1f} ms" for code in (OURS, USED)}
    return f"over numpy, least CPU times: {over[OURS]}; with the stages of a PI: {over[USED]}"


BENCHES = [
    Bench(
        "Import, a fresh interpreter each time",
        [contestant(code) for code in (OURS, *PEERS)],
        difference=None,
        memory=False,
        patience=2,
        remark=over_numpy,
    )
]
