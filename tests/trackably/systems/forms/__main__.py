"""Prove and check all fifty random chains and robots, and count: python -m tests.trackably.systems.forms.

It takes some minutes; the suite follows all fifty, and proves and checks a few of them.
"""

import json
from collections import Counter

from tests.trackably.systems.forms.test_chains import assert_follows, chain, long_chain, vehicle
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import check

MAKERS = {"chain": (chain, range(25)), "vehicle": (vehicle, range(25)), "long chain": (long_chain, (4, 5))}


def main() -> None:
    for name, (make, seeds) in MAKERS.items():
        counts = Counter[str]()
        for seed in seeds:
            reference = make(seed)
            assert_follows(reference)
            found = prove(reference)
            counts[f"prover: {type(found).__name__}"] += 1
            if isinstance(found, Certificate):
                verdict = check(json.loads(json.dumps(encode_certificate(found))))
                counts[f"checker: {type(verdict).__name__}"] += 1
            print(f"{name}: {seed + 1 - seeds[0]} of {len(seeds)} followed; {dict(counts)}", flush=True)


if __name__ == "__main__":
    main()
