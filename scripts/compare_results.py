"""Compares all datasets of two results bit for bit; attributes describe the run and may differ.

usage: compare_results.py FIRST.vtkhdf SECOND.vtkhdf
"""

import sys

import h5py


def datasets(path):
    found = {}
    with h5py.File(path) as file:
        keep = lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
        file.visititems(keep)
    return found


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    first, second = map(datasets, sys.argv[1:])
    if first.keys() != second.keys():
        sys.exit(f"error: other datasets: {sorted(first.keys() ^ second.keys())}")
    for name, values in first.items():
        other = second[name]
        if values.shape != other.shape or values.dtype != other.dtype or values.tobytes() != other.tobytes():
            sys.exit(f"error: {name} differs")
    print(f"{len(first)} datasets, {sum(values.nbytes for values in first.values())} bytes: equal")


if __name__ == "__main__":
    main()
