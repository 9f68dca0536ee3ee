// Pictures as files, and where the programs are.
#include <pybind11/pybind11.h>
#include <pybind11/stl/filesystem.h>

#include <string>
#include <utility>

#include "python/core/arrays.h"
#include "python/core/bind.h"
#include "render/world/renderer.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Bytes = py::array_t<std::uint8_t, py::array::c_style>;

Image8 ImageFrom(const Bytes& array) {
  if (array.ndim() != 3 || (array.shape(2) != 1 && array.shape(2) != 3 && array.shape(2) != 4) || array.size() == 0)
    throw py::value_error("a picture has the shape (height, width, 1, 3 or 4) and holds uint8");
  Image8 image(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)), static_cast<int>(array.shape(2)));
  std::copy_n(array.data(), image.data.size(), image.data.data());
  return image;
}

}  // namespace

void BindFiles(py::module_& m) {
  m.def(
      "read_image",
      [](const fs::path& file) {
        Image8 image;
        {
          const py::gil_scoped_release others_may_run;
          image = ReadImage8(file, 3);
        }
        const Shape shape{image.height, image.width, 3};
        return ArrayOf(std::move(image.data), shape);
      },
      py::arg("file"), "(height, width, 3) uint8, RGB, brought to sRGB where the file has a colour profile.");
  m.def(
      "write_image",
      [](const fs::path& file, const Bytes& picture) {
        const Image8 image = ImageFrom(picture);
        const py::gil_scoped_release others_may_run;
        WriteImage(file, image);
      },
      py::arg("file"), py::arg("picture"), "Writes PNG or JPEG: (height, width, 1, 3 or 4) uint8.");
  m.def(
      "resize",
      [](const Bytes& picture, int width, int height) {
        if (width < 1 || height < 1 || width > kMaxPictureSide || height > kMaxPictureSide)
          throw py::value_error("width and height take 1 to " + std::to_string(kMaxPictureSide));
        Image8 image = ImageFrom(picture);
        {
          const py::gil_scoped_release others_may_run;
          image = Resize(image, width, height);
        }
        const Shape shape{image.height, image.width, image.channels};
        return ArrayOf(std::move(image.data), shape);
      },
      py::arg("picture"), py::arg("width"), py::arg("height"),
      "Another size of a (height, width, channels) uint8 picture: by area averaging, or bilinear where it grows; what "
      "held-out photos are compared at.");
  m.def(
      "psnr_db",
      [](const Bytes& a, const Bytes& b) {
        const Image8 left = ImageFrom(a), right = ImageFrom(b);
        if (left.width != right.width || left.height != right.height || left.channels != right.channels)
          throw py::value_error("the pictures differ in size");
        const py::gil_scoped_release others_may_run;
        return Compare(left, right).psnr_db;
      },
      py::arg("a"), py::arg("b"), "Over all pixels of two pictures of one size, as the programs' figures are.");
  m.def("program_path", &SiblingProgram, py::arg("name"), "Where a program of the suite is.");
}

}  // namespace lumi
