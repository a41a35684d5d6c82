"""Plots of benches/scaling as SVG, without a plotting library."""

import math

COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"]
STYLE = (
    "text { font: 12px sans-serif; fill: #222 } .title { font-size: 15px; font-weight: bold }"
    " .small { font-size: 11px; fill: #666 } .grid { stroke: #ddd }"
    " .ideal { fill: none; stroke: #888; stroke-dasharray: 5 4 } .beyond { fill: #f2f2f2 }"
)
WIDTH, HEIGHT, TOP = 330, 260, 60


class Panel:
    """Axes with a logarithmic abscissa."""

    def __init__(self, left, title, axes, counts, highest):
        self.left = left
        self.least, self.most = min(counts), max(counts)
        self.span = max(1.0, math.log2(self.most / self.least))
        steps = (0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 1e3, 1e4, 1e9)
        step = next(s for s in steps if highest / s <= 6)
        self.ceiling = math.ceil(highest * 1.02 / step) * step
        bottom = TOP + HEIGHT
        self.parts = [f'<text x="{left}" y="{TOP - 26}" class="title">{title}</text>']
        self.text(left, TOP - 8, axes[1], "small")
        self.text(left + WIDTH / 2, bottom + 38, axes[0], anchor="middle")
        for k in range(round(self.ceiling / step) + 1):
            y = self.y(k * step)
            self.parts.append(f'<line x1="{left}" x2="{left + WIDTH}" y1="{y:.1f}" y2="{y:.1f}" class="grid"/>')
            self.text(left - 6, y + 4, f"{k * step:g}", anchor="end")
        for count in sorted(set(counts)):
            self.text(self.x(count), bottom + 18, f"{count:g}" if count < 1e4 else f"{count:.0e}", anchor="middle")

    def x(self, count):
        return self.left + 20 + (WIDTH - 40) * math.log2(count / self.least) / self.span

    def y(self, amount):
        return TOP + HEIGHT * (1 - amount / self.ceiling)

    def text(self, x, y, words, style=None, anchor="start"):
        style = f' class="{style}"' if style else ""
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}"{style} text-anchor="{anchor}">{words}</text>')

    def ideal(self, of):
        counts = [self.least * (self.most / self.least) ** (k / 40) for k in range(41)]
        line = " ".join(f"{self.x(count):.1f},{self.y(of(count)):.1f}" for count in counts)
        self.parts.append(f'<polyline points="{line}" class="ideal"/>')

    def beyond(self, cores):
        """Mark the range beyond the available cores."""
        if self.most <= cores:
            return
        edge = max(self.left, self.x(max(self.least, cores)) + 8)
        width = self.left + WIDTH - edge
        # Insert the rectangle at the start, so that the axes are drawn above the rectangle.
        self.parts.insert(0, f'<rect x="{edge:.1f}" y="{TOP}" width="{width:.1f}" height="{HEIGHT}" class="beyond"/>')
        self.text(self.left + WIDTH - 4, TOP + HEIGHT - 8, "more than the cores", "small", "end")

    def line(self, number, name, points):
        """Draw a line through points (count, amount), and write its name into the legend at the lower left."""
        colour = COLOURS[number % len(COLOURS)]
        places = [(self.x(count), self.y(amount)) for count, amount in points]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        self.parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        row = TOP + HEIGHT - 14 - 18 * number
        for x, y in [*places, (self.left + 14, row - 4)]:
            self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')
        self.text(self.left + 24, row, name)


def measured(left, runs, title, axis, key, ideal, cores):
    """Draw a panel of measured layouts, one line per number of ranks."""
    counts = [run["cores"] for run in runs]
    least = min(counts)
    highest = max([run[key] for run in runs] + [ideal(max(counts) / least)])
    panel = Panel(left, title, ("ranks × threads in all", axis), counts, highest)
    panel.beyond(cores)
    panel.ideal(lambda count: ideal(count / least))
    for number, ranks in enumerate(sorted({run["ranks"] for run in runs})):
        points = [(run["cores"], run[key]) for run in runs if run["ranks"] == ranks]
        panel.line(number, f"{ranks} rank{'s' if ranks > 1 else ''}", points)
    return panel.parts


def modelled(left, given, predicted):
    """Draw the panel of the model."""
    names = {
        "weak": f"{given['points']:.2g} points a rank",
        "strong": f"{given['total']:.2g} points in all",
    }
    counts = [row["ranks"] for row in predicted["weak"]]
    axes = (f"ranks of {given['cores']:g} cores", "efficiency")
    panel = Panel(left, "Model of many ranks", axes, counts, 1.0)
    panel.ideal(lambda count: 1.0)
    for number, (kind, rows) in enumerate(predicted.items()):
        panel.line(number, names[kind], [(row["ranks"], row["efficiency"]) for row in rows])
    return panel.parts


def plot(runs, cores, given, predicted):
    """Return all panels as the text of an SVG file."""
    panels = []
    strong = [run for run in runs if run["kind"] == "strong"]
    weak = [run for run in runs if run["kind"] == "weak"]
    if strong:
        title = f"Strong scaling, {strong[0]['points']:.0f} points"
        panels.append((strong, title, "speed-up; dashed: ideal", "speed_up", lambda ratio: ratio))
    if weak:
        each = weak[0]["points"] / weak[0]["cores"]
        title = f"Weak scaling, {each:.0f} points per core"
        panels.append((weak, title, "efficiency; dashed: ideal", "efficiency", lambda ratio: 1.0))
    parts = []
    for k, (chosen, title, axis, key, ideal) in enumerate(panels):
        parts += measured(60 + 400 * k, chosen, title, axis, key, ideal, cores)
    parts += modelled(60 + 400 * len(panels), given, predicted)
    width = 60 + 400 * (len(panels) + 1)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="380" viewBox="0 0 {width} 380">'
    back = f'<rect width="{width}" height="380" fill="white"/>'
    return "\n".join([head, f"<style>{STYLE}</style>", back, *parts, "</svg>", ""])
