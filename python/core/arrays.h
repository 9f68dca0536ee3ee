// NumPy arrays over memory that C++ keeps, and C++ values from arrays.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

namespace lumi {

namespace py = pybind11;
using Shape = std::vector<py::ssize_t>;

// Over memory that lives as long as `owner`; nobody may write it.
template <typename T>
py::array_t<T> ArrayOver(const T* data, const Shape& shape, const Shape& strides, py::handle owner) {
  py::array_t<T> array(shape, strides, data, owner);
  array.attr("setflags")(false);
  return array;
}
template <typename T>
py::array_t<T> ArrayOver(const T* data, const Shape& shape, py::handle owner) {
  Shape strides(shape.size(), sizeof(T));
  for (std::size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return ArrayOver(data, shape, strides, owner);
}

// Takes the vector's memory over.
template <typename T, typename Memory>
py::array_t<T> ArrayOf(std::vector<T, Memory>&& values, const Shape& shape) {
  auto* kept = new std::vector<T, Memory>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T, Memory>*>(p); });
  return py::array_t<T>(shape, kept->data(), owner);
}

// Of matrices (or numbers) that are made one at a time: (count, rows, columns), without the dimensions that are 1.
template <typename Make>
py::array_t<double> ArrayOfEach(std::size_t count, Make&& make) {
  using Matrix = std::decay_t<decltype(make(std::size_t{0}))>;
  Shape shape{static_cast<py::ssize_t>(count)};
  if constexpr (std::is_arithmetic_v<Matrix>) {
    std::vector<double> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = make(i);
    return ArrayOf(std::move(values), shape);
  } else {
    constexpr int kRows = Matrix::RowsAtCompileTime, kColumns = Matrix::ColsAtCompileTime;
    shape.push_back(kRows);
    if (kColumns > 1) shape.push_back(kColumns);
    std::vector<double> values;
    values.reserve(count * kRows * kColumns);
    for (std::size_t i = 0; i < count; ++i) {
      const Matrix m = make(i);
      for (int r = 0; r < kRows; ++r)
        for (int c = 0; c < kColumns; ++c) values.push_back(static_cast<double>(m(r, c)));
    }
    return ArrayOf(std::move(values), shape);
  }
}

// What numbers come as: anything that NumPy makes doubles of.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

template <int rows, int columns>
Eigen::Matrix<double, rows, columns> MatrixFrom(const Doubles& array, const char* name) {
  constexpr bool kVector = columns == 1;
  const bool fits = kVector ? array.ndim() == 1 && array.shape(0) == rows
                            : array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == columns;
  if (!fits)
    throw py::value_error(std::string(name) + " must have the shape (" + std::to_string(rows) +
                          (kVector ? "," : ", " + std::to_string(columns)) + ")");
  Eigen::Matrix<double, rows, columns> m;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) m(r, c) = array.data()[r * columns + c];
  return m;
}

}  // namespace lumi
