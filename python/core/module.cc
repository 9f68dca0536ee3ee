// lumigraph._core: what Python sees of the renderer. Plain functions over arrays stand in python/lumigraph.
#include <pybind11/pybind11.h>

#include "python/core/bind.h"
#include "scene/program/parallel.h"
#include "scene/program/version.h"

PYBIND11_MODULE(_core, m) {
  m.doc() = "Unstructured lumigraphs: scenes, weights and pictures as NumPy arrays. Use it as `lumigraph`.";
  m.attr("__version__") = lumi::kVersion;
  m.def("set_threads", &lumi::SetThreadCount, pybind11::arg("count"),
        "How many threads work from now on, in this process; 0: one a core.");
  m.def("threads", &lumi::ThreadCount, "How many threads work.");
  lumi::BindErrors(m);
  lumi::BindScene(m);
  lumi::BindLumigraph(m);
  lumi::BindFiles(m);
}
