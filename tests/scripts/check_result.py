"""Checks that h5py and VTK's reader read equal data from a result file.

usage: check_result.py RESULT.h5

Compares all steps, fields, points and times. If the result has an .xdmf file, the file must be well-formed XML and
refer to datasets of the declared shape. Prints one line and exits with 0, or prints the first
difference and exits with 1.
"""

import pathlib
import sys
import xml.etree.ElementTree as xml

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkOutputWindow
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkIOHDF import vtkHDFReader


def expect(condition, message):
    if not condition:
        sys.exit(f"error: {message}")


def equal(first, second, what):
    expect(first.shape == second.shape, f"{what}: shapes {first.shape} and {second.shape}")
    expect(numpy.array_equal(first, second, equal_nan=True), f"{what}: values differ")


def check_vtk(path, file):
    """Compare the data read by VTK and by h5py; return (steps, points, fields)."""
    root = file["VTKHDF"]
    steps = root["Steps"]
    count = int(steps.attrs["NSteps"])
    # One number of points for all steps, or one per step with adaptive refinement.
    counts = root["NumberOfPoints"][:]
    changing = root["PointData"]["id"].maxshape[0] is None
    names = sorted(root["PointData"])
    kind = root.attrs.get_id("Type").get_type()
    expect(not kind.is_variable_str(), "the attribute Type must be a fixed-length string")

    reader = vtkHDFReader()
    expect(reader.CanReadFile(str(path)), "VTK cannot read this file")
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    if count:
        expect(reader.GetNumberOfSteps() == count, f"VTK sees {reader.GetNumberOfSteps()} steps")
        times = reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())
        equal(numpy.atleast_1d(times), steps["Values"][:count], "times")
    for step in range(count):
        points = int(counts[step if changing else 0])
        first = int(steps["PointOffsets"][step])
        reader.UpdateTimeStep(float(steps["Values"][step]))
        grid = reader.GetOutput()
        expect(grid.GetNumberOfPoints() == points, f"step {step}: {grid.GetNumberOfPoints()} points")
        expect(grid.GetNumberOfCells() == points, f"step {step}: {grid.GetNumberOfCells()} cells")
        expect(grid.GetCellType(points - 1) == 1, f"step {step}: cells are not vertices")
        equal(vtk_to_numpy(grid.GetPoints().GetData()), root["Points"][first : first + points], f"step {step}: points")
        data = grid.GetPointData()
        seen = sorted(data.GetArrayName(index) for index in range(data.GetNumberOfArrays()))
        expect(seen == names, f"step {step}: VTK reads {seen}, the file has {names}")
        for name in names:
            offset = int(steps["PointDataOffsets"][name][step])
            stored = root["PointData"][name][offset : offset + points]
            equal(vtk_to_numpy(data.GetArray(name)), stored, f"step {step}: {name}")
    return count, int(counts[-1]), len(names)


def check_xdmf(path, file, count):
    """Check that every item of the side-car is a dataset of the declared shape."""
    tree = xml.parse(path)
    grids = tree.findall("./Domain/Grid/Grid")
    expect(len(grids) == count, f"{path.name} has {len(grids)} steps, the result {count}")
    for item in tree.iter("DataItem"):
        if item.get("Format") != "HDF":
            continue
        name, _, place = item.text.partition(":")
        expect(name == pathlib.Path(file.filename).name, f"{path.name} points to {name}")
        declared = tuple(int(size) for size in item.get("Dimensions").split())
        # A stopped run has allocated space for further rows.
        shape = file[place].shape
        fits = shape[1:] == declared[1:] and shape[0] >= declared[0]
        expect(fits, f"{path.name}: {place} is {shape}, not {declared}")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    path = pathlib.Path(sys.argv[1])
    expect(path.is_file(), f"there is no file {path}")
    problems = []
    vtkOutputWindow.GetInstance().AddObserver("ErrorEvent", lambda *_: problems.append("error"))
    vtkOutputWindow.GetInstance().AddObserver("WarningEvent", lambda *_: problems.append("warning"))
    with h5py.File(path, "r") as file:
        count, points, fields = check_vtk(path, file)
        rows = len(file["history"]) if "history" in file else 0
        sidecar = path.with_suffix(".xdmf")
        if sidecar.exists():
            check_xdmf(sidecar, file, count)
    expect(not problems, f"VTK reported {len(problems)} problems")
    print(f"{path.name}: {count} steps, {points} points, {fields} fields, {rows} history rows: equal")


if __name__ == "__main__":
    main()
