"""Teaches the networks: `python -m benchmarks.segmentation.teach --out FILE.onnx` (`--help`), an hour on two cores;
with `--plan beyond` the light one that looks beyond outlines, a quarter of one, and with `--plan seams` or `holes`,
mostly from that one on (`--start`), its likes that tell seams, and what lies on comb from holes in it; with
`--plan covers` the one that sees more of the picture, and what lies over an edge, in eighty minutes.

What comes out differs in its last digits from machine to machine, and so from what is in `contour/segmentation/`.
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import cv2
import numpy as np
import onnx
import torch
from torch import Tensor, nn
from torch.nn import functional

from benchmarks.segmentation.crops import Crop, crop
from benchmarks.segmentation.examples import Example, example
from contour.segmentation.network import LIGHT_PITCH_PX, PITCH_PX

# Far from the seeds of every page and test.
FIRST = 90_000_000
_BATCH = 16
_RATE = 3e-3
# Near an outline, within half a pitch, what is told counts so many times as much.
_NEAR = 4.0
# By so many crops a network that goes on learning is normed at first.
_FEW = 96


class _Plan(NamedTuple):
    """A network: the channels of each of its sizes, how far apart its lowest layers look, how many layers lead up; what
    it tells of, each with what it counts; how many times smaller than crops are it sees pictures; how many of these
    mostly have a hole, or a thing that looks like one; the pitch of cells in them; and whether more hands draw them.
    """

    widths: tuple[int, ...]
    apart: tuple[int, ...]
    layers_up: int
    told: dict[str, float]
    smaller: int
    holed: float = 0.0
    pitch_px: float = PITCH_PX
    more_hands: bool = False


PLANS = {
    "comb": _Plan((12, 24, 48, 64), (1, 2, 4, 2), 2, {"wall": 2.0, "comb": 1.0, "thing": 1.0}, 1),
    "beyond": _Plan((8, 16, 24, 32), (1, 2, 4), 1, {"comb": 1.0, "thing": 0.5}, 2),
    "seams": _Plan((8, 16, 24, 32), (1, 2, 4), 1, {"comb": 1.0, "thing": 0.5, "seam": 1.0}, 2),
    "holes": _Plan((8, 16, 24, 32), (1, 2, 4), 1, {"comb": 0.5, "thing": 1.0}, 2, holed=1.0),
    "covers": _Plan((12, 24, 32, 48, 64), (1, 2, 4), 1, {"comb": 0.5, "thing": 1.0}, 1, 0.2, LIGHT_PITCH_PX, True),
}


def _layer(before: int, after: int, apart: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(before, after, 3, padding=apart, dilation=apart, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(after), nn.ReLU(inplace=True))


class Network(nn.Module):
    """Sizes, each half of the one above it, down and up again: a U-Net of 274,000 weights, 250,000, or 58,000."""

    def __init__(self, plan: _Plan) -> None:
        super().__init__()
        *widths, lowest = plan.widths
        before = (1, *widths)
        self.down = nn.ModuleList(
            nn.Sequential(_layer(one, next_), _layer(next_, next_)) for one, next_ in itertools.pairwise(before)
        )
        self.bottom = nn.Sequential(
            _layer(widths[-1], lowest), *(_layer(lowest, lowest, far) for far in plan.apart[1:])
        )
        below = (lowest, *reversed(widths))
        self.up = nn.ModuleList(
            nn.Sequential(_layer(one + beside, beside), *(_layer(beside, beside) for _ in range(plan.layers_up - 1)))
            for one, beside in itertools.pairwise(below)
        )
        self.told = nn.Conv2d(widths[0], len(plan.told), 1)

    def forward(self, light: Tensor) -> Tensor:
        """Logits of what it tells, (N, K, h, w)."""
        kept = []
        for step in self.down:
            light = step(light)
            kept.append(light)
            light = functional.max_pool2d(light, 2)
        light = self.bottom(light)
        for step, beside in zip(self.up, reversed(kept), strict=True):
            light = step(torch.cat([functional.interpolate(light, scale_factor=2, mode="nearest"), beside], 1))
        told: Tensor = self.told(light)
        return told


class _Sure(nn.Module):
    """The network's answer as shares."""

    def __init__(self, network: Network) -> None:
        super().__init__()
        self.network = network

    def forward(self, light: Tensor) -> Tensor:
        return torch.sigmoid(self.network(light))


class _Crops(torch.utils.data.IterableDataset[tuple[Tensor, ...]]):
    def __init__(self, examples: Sequence[Example], seed: int, *, holed: float) -> None:
        self.examples, self.seed, self.holed = examples, seed, holed

    def __iter__(self) -> Iterator[tuple[Tensor, ...]]:
        cv2.setNumThreads(1)
        worker = torch.utils.data.get_worker_info()
        rng = np.random.default_rng([self.seed, 0 if worker is None else worker.id])
        while True:
            one = self.examples[int(rng.integers(len(self.examples)))]
            planes = crop(one, rng, holed=rng.random() < self.holed)
            yield tuple(torch.from_numpy(np.ascontiguousarray(plane)) for plane in planes)


def loss(told: Tensor, true: dict[str, Tensor], plan: _Plan) -> Tensor:
    """By how much what is told, (N, K, h, w), differs from what is true, each (N, 1, h, w)."""
    near_px = round(0.5 * plan.pitch_px / plan.smaller)
    window = 2 * near_px + 1, 1, near_px
    near = functional.max_pool2d(true["comb"], *window) + functional.max_pool2d(-true["comb"], *window)
    counts = 1.0 + (_NEAR - 1.0) * near
    off = torch.zeros(())
    for number, (name, share) in enumerate(plan.told.items()):
        one = told[:, number : number + 1]
        off = (
            off
            + share * (functional.binary_cross_entropy_with_logits(one, true[name], reduction="none") * counts).mean()
        )
    return off


def teach(network: Network, plan: _Plan, examples: Sequence[Example], minutes: float, rate: float, seed: int) -> None:
    """Show it parts of the examples for so long, less and less of each of which it takes to heart."""
    crops = torch.utils.data.DataLoader(
        _Crops(examples, seed, holed=plan.holed), batch_size=_BATCH, num_workers=2, prefetch_factor=4
    )
    taught = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=1e-3)
    began, lately = time.monotonic(), []
    for number, planes in enumerate(crops):
        light, *shares = (functional.avg_pool2d(plane[:, None], plan.smaller) for plane in planes)
        done = (time.monotonic() - began) / (60.0 * minutes)
        if done >= 1.0:
            return
        for group in taught.param_groups:
            group["lr"] = rate * min(1.0, (number + 1) / 100) * 0.5 * (1.0 + math.cos(math.pi * done)) + 1e-5
        with torch.autocast("cpu", dtype=torch.bfloat16):
            told = network(light.to(memory_format=torch.channels_last))
        off = loss(told.float(), dict(zip(Crop._fields[1:], shares, strict=True)), plan)
        taught.zero_grad()
        off.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        taught.step()
        lately.append(off.item())
        if number % 50 == 49:
            print(f"{number + 1} batches, {100.0 * done:.0f} %, off {np.mean(lately[-50:]):.4f}", flush=True)


def take_up(network: Network, path: str, light: Tensor) -> None:
    """Have a network begin as what is in the file of one of its kind; of what that doesn't tell it knows nothing yet.

    In the file what each layer is normed by has gone into its weights. It is norms again, of what `light` leads to.
    """
    graph = onnx.load(path).graph
    kept = {one.name: torch.from_numpy(onnx.numpy_helper.to_array(one).copy()) for one in graph.initializer}
    layers = [[kept[name] for name in node.input[1:]] for node in graph.node if node.op_type == "Conv"]
    convolutions = (one for one in network.modules() if isinstance(one, nn.Conv2d))
    norms = [one for one in network.modules() if isinstance(one, nn.BatchNorm2d)]
    with torch.no_grad():
        for convolution, (weight, _) in zip(convolutions, layers, strict=True):
            convolution.weight[: len(weight)] = weight
        network.told.bias[: len(layers[-1][1])] = layers[-1][1]
        hooks = [
            norm.register_forward_pre_hook(partial(_nothing_normed, more=bias))
            for norm, (_, bias) in zip(norms, layers[:-1], strict=True)
        ]
        network(light)
    for hook in hooks:
        hook.remove()


def _nothing_normed(norm: nn.BatchNorm2d, into: tuple[Tensor, ...], *, more: Tensor) -> None:
    """Have a norm add so much to what comes into it, and no more."""
    var, mean = torch.var_mean(into[0], (0, 2, 3), correction=0)
    norm.running_mean, norm.running_var = mean, var
    norm.weight.copy_(torch.sqrt(var + norm.eps))
    norm.bias.copy_(mean + more)


def export(network: Network, path: str) -> None:
    """Write the network as what OpenCV reads."""
    light = torch.zeros(1, 1, 64, 96)
    sides = {2: "h", 3: "w"}
    axes = {"light": sides, "told": sides}
    names = {"input_names": ["light"], "output_names": ["told"]}
    torch.onnx.export(_Sure(network.eval()), light, path, dynamic_axes=axes, dynamo=False, opset_version=13, **names)


def main() -> None:
    """Render, teach, and write the network."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.segmentation.teach", description=__doc__)
    parser.add_argument("--examples", type=int, default=1500, metavar="N", help="blocks to render")
    parser.add_argument("--first", type=int, default=FIRST, metavar="SEED", help="the first one's seed")
    parser.add_argument("--minutes", type=float, default=40.0, help="how long it is taught")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn of the examples")
    parser.add_argument("--rate", type=float, default=_RATE, help="how fast it learns at first")
    parser.add_argument("--start", metavar="FILE", help="a network that goes on learning, .onnx")
    parser.add_argument("--plan", choices=PLANS, default="comb", help="which network")
    parser.add_argument("--out", required=True, metavar="FILE", help="where the network goes, .onnx")
    options = parser.parse_args()
    cv2.setNumThreads(1)  # what is forked has none of its threads, and would wait for them
    seeds, plan = range(options.first, options.first + options.examples), PLANS[options.plan]
    with ProcessPoolExecutor(2, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        examples = list(
            pool.map(partial(example, pitch_px=plan.pitch_px, more_hands=plan.more_hands), seeds, chunksize=4)
        )
    network = Network(plan).to(memory_format=torch.channels_last)
    if options.start is not None:
        crops = (crop(examples[number % len(examples)], np.random.default_rng(number)).light for number in range(_FEW))
        light = torch.from_numpy(np.stack(list(crops)))[:, None]
        take_up(network, options.start, functional.avg_pool2d(light, plan.smaller))
    teach(network, plan, examples, options.minutes, options.rate, options.seed)
    export(network, options.out)


if __name__ == "__main__":
    main()
