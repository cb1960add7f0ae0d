#!/usr/bin/env python3
"""Asks Mitsuba 3 for the pictures that `afterlight reference` computes, and judges by statistics whether both compute the same.

What both should agree on is the mean of a pixel. The only thing that is left to chance in these scenes is where in the pixel a ray goes, so the
standard error of Mitsuba's mean is known: from the spread over independent seeds, and from the spread within the pixel that the reference has
found. The reference takes many more samples, which lie more evenly, so that its own error is small beside that. At each pixel and
channel z = (Mitsuba - reference) / standard error should then be a deviate of mean 0 and standard deviation 1:

  mean   within four of its standard errors of 0. A channel's z values are independent from pixel to pixel; channels are not.
  std    within 0.05 of 1, and four of its standard errors.
  |z|>3  0.27% of a normal deviate. A pixel that is hardly touched by an edge is Poisson's and has a longer tail: 0.3% more is allowed.
  |z|    at most 7: no single pixel may be wrong.

Pixels where both are constant have no standard error; there they must agree to 1e-4 of the value, as single precision has it.
Every pixel counts, those on edges and in half-shadow too.
"""

import argparse
import math
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")

HERE = pathlib.Path(__file__).resolve().parent
SCENES = ["lambert", "ggx", "lights"]
SINGLE_PRECISION = 1e-4


def read(path):
    return numpy.array(mitsuba.Bitmap(str(path)), dtype=numpy.float64)[:, :, :3]


def reference(program, scene, folder, samples, smith):
    """Mean and standard error of the mean by the reference, as independent samples would have it."""
    truth, error = folder / "truth.exr", folder / "error.exr"
    options = ["--samples", str(samples), "--smith", smith, "--no-cache", "--quiet"]
    command = [program, "reference", scene, "-o", truth, "--standard-error", error, *options]
    subprocess.run(command, check=True)
    return read(truth), read(error)


def one_light_each(folder):
    """The exported scene once for each of its lights: to choose one at random for each sample would only add noise."""
    tree = ElementTree.parse(folder / "scene.xml")
    root = tree.getroot()
    for name in root.iter("string"):
        if name.get("name") == "filename":
            name.set("value", str(folder / name.get("value")))
    lights = root.findall("emitter")
    for light in lights:
        root.remove(light)
    for light in lights:
        root.append(light)
        yield mitsuba.load_string(ElementTree.tostring(root, encoding="unicode"))
        root.remove(light)


def ask_mitsuba(program, scene, folder, seeds, samples):
    """Mean over all seeds, and its standard error by their spread."""
    subprocess.run([program, "reference", scene, "--export", folder, "--quiet"], check=True)
    # The same for each light, so that a seed's pictures add up to one of the same rays. Not in a row: the mean over a picture scatters 1.7
    # times as much over seeds 0, 1, 2, ... as it should, and as it does over these. Nor far apart in even steps: some repeat each other.
    chosen = numpy.random.default_rng(20).integers(0, 1 << 32, seeds)
    pictures = 0
    for light in one_light_each(folder):
        render = lambda seed: numpy.array(mitsuba.render(light, seed=int(seed), spp=samples), dtype=numpy.float64)
        pictures = pictures + numpy.stack([render(seed) for seed in chosen])
    return pictures.mean(axis=0), pictures.std(axis=0, ddof=1) / math.sqrt(seeds)


def judge(mean, error, truth, truth_error, ratio):
    """The figures of a comparison, and what is wrong with them."""
    # Each of both estimates the same: the one knows pixels that a rare sample touches when that has happened, the other before.
    expected = numpy.sqrt(0.5 * (error**2 + truth_error**2 * ratio))
    scale = numpy.maximum(numpy.abs(mean), numpy.abs(truth))
    constant = expected <= SINGLE_PRECISION * 0.1 * scale
    apart = numpy.abs(mean - truth)
    wrong = []
    broken = constant & (apart > SINGLE_PRECISION * scale)
    if broken.any():
        wrong.append(f"{broken.sum()} values without noise differ by more than {SINGLE_PRECISION:g} of themselves")
    z = (mean - truth)[~constant] / expected[~constant]
    pixels = int((~constant).any(axis=2).sum())
    figures = {
        "values": z.size,
        "constant": int(constant.sum()),
        "mean": z.mean(),
        "std": z.std(),
        "beyond": (numpy.abs(z) > 3).mean(),
        "largest": numpy.abs(z).max(),
        "relative": apart.sum() / truth.sum(),
    }
    mean_limit = 4 / math.sqrt(pixels)
    if abs(figures["mean"]) > mean_limit:
        wrong.append(f"the mean of z is {figures['mean']:+.3f}, beyond {mean_limit:.3f}")
    std_limit = 0.05 + 4 / math.sqrt(2 * pixels)
    if abs(figures["std"] - 1) > std_limit:
        wrong.append(f"the standard deviation of z is {figures['std']:.3f}, not within {std_limit:.3f} of 1")
    beyond_limit = 0.0027 + 0.003
    if figures["beyond"] > beyond_limit:
        wrong.append(f"{100 * figures['beyond']:.2f}% of |z| are above 3, more than {100 * beyond_limit:.2f}%")
    if figures["largest"] > 7:
        wrong.append(f"the largest |z| is {figures['largest']:.1f}, above 7")
    return figures, wrong


def row(name, figures, wrong):
    return (
        f"| {name} | {figures['values']} | {figures['constant']} | {figures['mean']:+.3f} | {figures['std']:.3f} "
        f"| {100 * figures['beyond']:.2f}% | {figures['largest']:.2f} | {100 * figures['relative']:.3f}% "
        f"| {'no' if wrong else 'yes'} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", default="target/release/afterlight", help="the afterlight to ask")
    parser.add_argument("--seeds", type=int, default=64, help="independent pictures by Mitsuba")
    parser.add_argument("--spp", type=int, default=16, help="samples a pixel of each")
    parser.add_argument("--samples", type=int, default=4096, help="samples a pixel of the reference")
    parser.add_argument("--prove", action="store_true", help="also show that it can fail: what must differ is judged, too")
    parser.add_argument("scenes", nargs="*", default=SCENES, help="of " + ", ".join(SCENES))
    arguments = parser.parse_args()
    ratio = arguments.samples / (arguments.seeds * arguments.spp)
    print(f"Mitsuba {mitsuba.__version__}: {arguments.seeds} seeds of {arguments.spp} samples; reference: {arguments.samples} samples\n")
    print("| scene | values | constant | mean z | std z | \\|z\\| > 3 | largest \\|z\\| | mean difference | agree |")
    print("|---|---|---|---|---|---|---|---|---|")
    complaints = []
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.scenes:
            scene, place = HERE / f"{name}.toml", pathlib.Path(folder) / name
            place.mkdir()
            mean, error = ask_mitsuba(arguments.program, scene, place, arguments.seeds, arguments.spp)
            truth = reference(arguments.program, scene, place, arguments.samples, "separable")
            figures, wrong = judge(mean, error, *truth, ratio)
            print(row(name, figures, wrong), flush=True)
            complaints += [f"{name}: {complaint}" for complaint in wrong]
            if not arguments.prove:
                continue
            lies = {f"{name}, 0.5% too bright": [part * 1.005 for part in truth]}
            if name == "ggx":
                own = reference(arguments.program, scene, place, arguments.samples, "height-correlated")
                lies["ggx, height-correlated Smith"] = own
            for lie, truth in lies.items():
                figures, wrong = judge(mean, error, *truth, ratio)
                print(row(lie, figures, wrong), flush=True)
                if not wrong:
                    complaints.append(f"{lie}: it must not agree, and does")
    for complaint in complaints:
        print(f"error: {complaint}", file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
