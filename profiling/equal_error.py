"""Errors of renders by their seeds, whether two renderers show the same, and who takes how long to the same error."""
import numpy as np

EPSILON = 0.01  # of relMSE: the mean of (x − truth)² / (truth² + ε) over pixels and channels
BLOCK = 12  # pixels a side: pictures are also compared by blocks


class Row:
    """The runs of one renderer and sampler with one number of samples a pixel."""

    def __init__(self, renderer, asked):
        self.renderer, self.asked, self.wall, self.cpu, self.pictures = renderer, asked, [], [], []

    def measure(self, seed):
        self.samples, wall, cpu, picture = self.renderer.render(self.asked, seed)
        for column, value in ((self.wall, wall), (self.cpu, cpu), (self.pictures, picture)):
            column.append(value)

    def judge(self, truth, mask):
        """Mean and variance of the runs; errors are the mean variance of the pixels in `mask`, and relative to `truth`; and that of all
        pixels, edges of lamps among them."""
        self.mean, self.variance = np.mean(self.pictures, 0), np.var(self.pictures, 0, ddof=1)
        relative = self.variance / (truth**2 + EPSILON)
        self.errors = {"relMSE": float(relative[mask].mean()), "MSE": float(self.variance[mask].mean()),
                       "whole MSE": float(self.variance.mean())}

    def fields(self):
        return {"renderer": self.renderer.name, "sampler": self.renderer.sampler, "samples": self.samples,
                "seconds": self.wall, "cpu_seconds": self.cpu} | self.errors


def agreement(row, truth, truth_variance):
    """Mean difference, its z, the largest z of a block, and the squared difference over what the variances predict (1).

    Pixels of some samplers are correlated: sums over pixels then vary more than their variances sum to. By how much, is
    taken from how the sums vary between runs, all blocks together."""
    height, width = (n // BLOCK * BLOCK for n in truth.shape[:2])

    def blocks(pixels):
        return pixels[..., :height, :width, :].reshape(-1, height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).sum((2, 4))

    def z(sums, pixels):
        correlated = max(1, np.var(sums(np.array(row.pictures)), 0, ddof=1).sum() / sums(row.variance).sum())
        rounding = (1e-5 * truth) ** 2
        expected = correlated * sums(row.variance) / len(row.pictures) + sums(truth_variance + rounding)
        return float(np.abs(sums(pixels) / np.sqrt(expected)).max())

    difference = row.mean - truth
    predicted = row.variance.sum() / len(row.pictures) + truth_variance.sum()
    return {"difference": difference.mean() / truth.mean(), "z": z(lambda a: a.sum((-3, -2)), difference),
            "block_z": z(blocks, difference), "squares": float((difference**2).sum() / predicted)}


def time_at(error, curve, metric, clock, turn):
    """A renderer's time to an error in one turn, by its runs on both sides, log–log; and whether beyond all runs."""
    points = sorted((np.log(row.errors[metric]), np.log(getattr(row, clock)[turn])) for row in curve)
    x, y = map(np.array, zip(*points))
    at = int(np.clip(np.searchsorted(x, np.log(error)), 1, len(x) - 1))
    slope = (y[at] - y[at - 1]) / (x[at] - x[at - 1])
    return np.exp(y[at] + slope * (np.log(error) - x[at])), not x[0] <= np.log(error) <= x[-1]


def ratios(theirs, curve):
    """Mitsuba's time over comber's time to the same error: quartiles over turns, by metric and clock."""
    turns = range(len(theirs.wall))
    found = {"sampler": theirs.renderer.sampler, "samples": theirs.samples, "extrapolated": False}

    def quartiles(metric, clock, more=0.0):
        times = [time_at(theirs.errors[metric], curve, metric, clock, turn) for turn in turns]
        found["extrapolated"] |= times[0][1]
        over = [(getattr(theirs, clock)[t] + more) / times[t][0] for t in turns]
        return np.quantile(over, [0.25, 0.5, 0.75]).tolist()

    found["relMSE"], found["MSE"] = quartiles("relMSE", "wall"), quartiles("MSE", "wall")
    found["whole MSE"] = quartiles("whole MSE", "wall")
    found["relMSE_cpu"] = quartiles("relMSE", "cpu")
    found["relMSE_compiling"] = quartiles("relMSE", "wall", theirs.renderer.compiling)
    same = min(curve, key=lambda row: abs(np.log(row.samples / theirs.samples)))
    product = [row.errors["relMSE"] * np.array(row.wall) for row in (theirs, same)]
    return found | {"products": np.quantile(product[0] / product[1], [0.25, 0.5, 0.75]).tolist()}
