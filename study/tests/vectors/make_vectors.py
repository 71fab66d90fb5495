"""Makes statistics.json: inputs and what independent code says of them.

    pip install scipy numpy && python3 make_vectors.py > statistics.json

Made with scipy 1.17.1 and numpy 2.4.6. What scipy has, scipy says: `mannwhitneyu` (with ties over every permutation),
`wilcoxon`, `trim_mean`, `spearmanr`, `binomtest`, `quantile`. Signed ranks with ties, Holm, A12, performance profiles and the
bootstrap are written out here in the plainest way.
The bootstrap uses 200,000 resamples of numpy's generator; ours another one and fewer: they agree within sampling error.
"""

import itertools
import json

import numpy as np
from scipy import stats

rng = np.random.default_rng(11)
out = {}


def exact_mann_whitney(a, b):
    found = stats.mannwhitneyu(a, b, alternative="two-sided", method="exact")
    return {"a": a, "b": b, "u": float(found.statistic), "p": float(found.pvalue)}


def permuted_mann_whitney(a, b):
    every = stats.PermutationMethod(n_resamples=np.inf)
    found = stats.mannwhitneyu(a, b, alternative="two-sided", method=every)
    return {"a": a, "b": b, "u": float(found.statistic), "p": float(found.pvalue)}


def scores(n, at, grid):
    return [float(x) for x in np.round(rng.normal(at, 0.05, n) / grid) * grid]


cases = [exact_mann_whitney(list(rng.normal(0, 1, n)), list(rng.normal(m, 1, k)))
         for n, k, m in [(10, 10, 0), (10, 10, 1), (10, 10, 3), (5, 5, 1), (3, 8, 0.5), (1, 10, 2), (20, 20, 0.6), (30, 40, 0.3)]]
cases += [permuted_mann_whitney(scores(n, 0.9, g), scores(k, m, g))
          for n, k, m, g in [(10, 10, 0.9, 0.02), (10, 10, 0.94, 0.05), (5, 7, 0.8, 0.05), (3, 9, 0.95, 0.05), (8, 8, 0.92, 0.1)]]
# Floors and ceilings: all equal, and complete separation.
cases += [permuted_mann_whitney([1.0] * 5, [1.0] * 6), exact_mann_whitney([float(x) for x in range(10, 20)], [float(x) for x in range(10)])]
out["mann_whitney"] = cases


def brute_signed_rank(d):
    """All 2^n signs."""
    d = [x for x in d if x != 0]
    r = stats.rankdata(np.abs(d))
    observed = sum(r[i] for i in range(len(d)) if d[i] > 0)
    sums = np.array([sum(x for x, s in zip(r, signs) if s) for signs in itertools.product([0, 1], repeat=len(d))])
    p = 2 * min(np.mean(sums <= observed + 1e-9), np.mean(sums >= observed - 1e-9))
    return float(observed), float(min(p, 1.0))


cases = []
for n, m in [(12, 0.0), (25, 0.4), (50, 0.3), (6, 2.0)]:
    d = [float(x) for x in rng.normal(m, 1, n)]
    found = stats.wilcoxon(d, alternative="two-sided", method="exact")
    plus = float(sum(r for r, x in zip(stats.rankdata(np.abs(d)), d) if x > 0))
    cases.append({"differences": d, "plus": plus, "p": float(found.pvalue)})
for n, m in [(10, 0.3), (14, 0.1), (14, 0.8)]:
    d = [float(x) for x in np.round(rng.normal(m, 0.6, n) * 4) / 4]
    plus, p = brute_signed_rank(d)
    cases.append({"differences": d, "plus": plus, "p": p})
out["signed_rank"] = cases

out["mcnemar"] = [{"first": f, "second": s, "p": float(stats.binomtest(f, f + s, 0.5).pvalue) if f + s else 1.0}
                  for f, s in [(0, 0), (1, 0), (5, 5), (10, 2), (2, 10), (59, 2), (250, 3), (700, 650)]]


def holm(p):
    order = sorted(range(len(p)), key=lambda i: p[i])
    adjusted, most = [0.0] * len(p), 0.0
    for rank, i in enumerate(order):
        most = max(most, min(1.0, (len(p) - rank) * p[i]))
        adjusted[i] = most
    return adjusted


out["holm"] = [{"p": p, "adjusted": holm(p)} for p in ([0.01, 0.04, 0.03, 0.005], [0.5, 0.6], [0.02], [0.001, 0.001, 0.9, 0.04, 0.04])]
# The first by hand: 0.03, 0.06, 0.06, 0.02.

out["a12"] = [{"a": a, "b": b, "a12": float(np.mean([[(x > y) + 0.5 * (x == y) for y in b] for x in a]))}
              for a, b in [(scores(10, 0.9, 0.05), scores(10, 0.9, 0.05)), (scores(5, 0.9, 0.02), scores(8, 0.8, 0.02)), ([1.0], [1.0]), ([2.0, 3.0], [0.0, 1.0])]]

out["iqm"] = [{"values": v, "iqm": float(stats.trim_mean(v, 0.25))} for v in ([float(x) for x in rng.normal(0, 1, n)] for n in (1, 2, 3, 4, 5, 7, 10, 11, 40))]

out["rank_correlation"] = []
for n, g in [(10, 0.5), (20, 0.01), (5, 1.0)]:
    a = [float(x) for x in np.round(rng.normal(0, 1, n) / g) * g]
    b = [float(x) for x in np.round((np.array(a) + rng.normal(0, 1, n)) / g) * g]
    out["rank_correlation"].append({"a": a, "b": b, "rho": float(stats.spearmanr(a, b).statistic)})

s = [scores(10, 0.9, 0.01), scores(10, 0.6, 0.01)]
thresholds = [0.0, 0.5, 0.6, 0.8, 0.9, 0.95, 1.0]
out["profile"] = {"scores": s, "thresholds": thresholds, "shares": [float(np.mean(np.array(s) > t)) for t in thresholds]}

v = sorted(float(x) for x in rng.normal(0, 1, 23))
out["quantile"] = [{"sorted": v, "share": q, "value": float(np.quantile(v, q))} for q in (0.0, 0.025, 0.3, 0.5, 0.975, 1.0)]


def bootstrap(a, b, resamples):
    """Seeds of each method, then worlds, which all share; interval of IQM(a), of IQM(a) - IQM(b), of A12."""
    a, b = np.array(a), np.array(b)
    numbers = []
    for _ in range(resamples):
        worlds = rng.integers(0, a.shape[1], a.shape[1])
        x = a[rng.integers(0, a.shape[0], a.shape[0])][:, worlds].mean(axis=1)
        y = b[rng.integers(0, b.shape[0], b.shape[0])][:, worlds].mean(axis=1)
        ix, iy = stats.trim_mean(x, 0.25), stats.trim_mean(y, 0.25)
        wins = np.mean((x[:, None] > y[None, :] + 1e-12) + 0.5 * (np.abs(x[:, None] - y[None, :]) <= 1e-12))
        numbers.append((ix, ix - iy, wins))
    return [[float(q) for q in np.quantile([n[i] for n in numbers], [0.025, 0.975])] for i in range(3)]


hard = rng.normal(0, 1.5, 40)  # worlds differ more than seeds


def successes(seeds, skill):
    return [[float(rng.random() < 1 / (1 + np.exp(-(skill + 0.4 * s + h)))) for h in hard] for s in rng.normal(0, 1, seeds)]


a, b = successes(10, 1.5), successes(8, 0.8)
out["bootstrap"] = {"a": a, "b": b, "intervals": bootstrap(a, b, 200_000)}

print(json.dumps(out))
