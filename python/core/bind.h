// The parts of the module lumigraph._core, a file each.
#pragma once

#include <pybind11/pybind11.h>

namespace lumi {

void BindErrors(pybind11::module_& m);
void BindScene(pybind11::module_& m);      // Scene, Mesh, View
void BindLumigraph(pybind11::module_& m);  // Lumigraph, Picture, Plan, RayWeights
void BindFiles(pybind11::module_& m);      // pictures, programs

}  // namespace lumi
