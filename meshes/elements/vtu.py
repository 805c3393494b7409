"""Writes the meshes of this folder as VTU files, each encoded in another way. Needs vtk and meshio."""
import re
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

KINDS = {1: 3, 2: 5, 3: 9, 4: 10, 5: 12, 6: 13, 7: 14, 8: 21, 9: 22, 11: 24, 16: 23, 17: 25, 18: 26, 19: 27}
ORDER = {11: [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
         17: [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
         18: [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11],
         19: [0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12]}

def rows(text, name):
    inner = re.search(rf"\${name}\n(.*?)\$End", text, re.S).group(1)
    return [line.split() for line in inner.splitlines()[1:]]

def grid(order):
    text = open(f"order{order}_msh2.msh").read()
    names = {(int(r[0]), int(r[1])): r[2].strip('"') for r in rows(text, "PhysicalNames")}
    out = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for r in rows(text, "Nodes"):
        points.InsertNextPoint(*map(float, r[1:]))
    out.SetPoints(points)
    dimension = {15: 0, 1: 1, 8: 1, 2: 2, 3: 2, 9: 2, 16: 2}
    groups = []
    for r in rows(text, "Elements"):
        kind, tags = int(r[1]), int(r[2])
        nodes = [int(n) - 1 for n in r[3 + tags:]]
        nodes = [nodes[i] for i in ORDER.get(kind, range(len(nodes)))]
        out.InsertNextCell(KINDS[kind], len(nodes), nodes)
        groups.append(names[(dimension.get(kind, 3), int(r[3]))])
    for name in names.values():
        mark = numpy_to_vtk(np.array([g == name for g in groups], dtype=np.int32), deep=True)
        mark.SetName(name)
        out.GetCellData().AddArray(mark)
    x = numpy_to_vtk(np.array([points.GetPoint(i)[0] for i in range(points.GetNumberOfPoints())]), deep=True)
    x.SetName("x")
    out.GetPointData().AddArray(x)
    return out

def write(name, order, mode, compressed, raw=False, big=False, wide=False):
    w = vtk.vtkXMLUnstructuredGridWriter()
    w.SetInputData(grid(order))
    w.SetFileName(name)
    {"ascii": w.SetDataModeToAscii, "binary": w.SetDataModeToBinary, "appended": w.SetDataModeToAppended}[mode]()
    w.SetCompressorTypeToZLib() if compressed else w.SetCompressorTypeToNone()
    w.SetBlockSize(1024)
    w.SetEncodeAppendedData(0 if raw else 1)
    if big: w.SetByteOrderToBigEndian()
    if wide: w.SetHeaderTypeToUInt64()
    w.Write()

write("order1_ascii.vtu", 1, "ascii", False)
write("order1_binary.vtu", 1, "binary", False, wide=True)
write("order2_zlib.vtu", 2, "binary", True)
write("order2_appended.vtu", 2, "appended", True)
write("order1_appended_plain.vtu", 1, "appended", False, big=True)
write("order2_raw.vtu", 2, "appended", True, raw=True)
write("order1_raw_plain.vtu", 1, "appended", False, raw=True)
meshio.read("order1_msh2.msh").write("order1_meshio.vtu")
