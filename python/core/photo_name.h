// Photos as Python names them: a string, whatever its bytes are on disk, or a position.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

namespace lumi {

struct PhotoName {
  std::string text;
};
// Several, or one alone.
struct PhotoNames {
  std::vector<PhotoName> names;
};
inline std::vector<std::string> TextsOf(const PhotoNames& several) {
  std::vector<std::string> texts;
  for (const PhotoName& n : several.names) texts.push_back(n.text);
  return texts;
}
// As Python has names of files: bytes that are no UTF-8 are kept as surrogates.
inline pybind11::str ToPython(const std::string& name) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeFSDefaultAndSize(name.data(), static_cast<Py_ssize_t>(name.size())));
}

}  // namespace lumi

namespace pybind11::detail {

template <>
struct type_caster<lumi::PhotoName> {
  PYBIND11_TYPE_CASTER(lumi::PhotoName, const_name("Union[str, int]"));
  bool load(handle from, bool) {
    if (PyLong_Check(from.ptr()) && !PyBool_Check(from.ptr())) {
      value.text = str(from).cast<std::string>();
      return true;
    }
    if (!PyUnicode_Check(from.ptr())) return false;
    const auto bytes_of_name = reinterpret_steal<bytes>(PyUnicode_EncodeFSDefault(from.ptr()));
    if (!bytes_of_name) {
      PyErr_Clear();
      return false;
    }
    value.text = bytes_of_name;
    return true;
  }
  static handle cast(const lumi::PhotoName& name, return_value_policy, handle) {
    return lumi::ToPython(name.text).release();
  }
};

template <>
struct type_caster<lumi::PhotoNames> {
  PYBIND11_TYPE_CASTER(lumi::PhotoNames, const_name("Union[str, int, Sequence[Union[str, int]]]"));
  bool load(handle from, bool convert) {
    type_caster<lumi::PhotoName> one;
    if (one.load(from, convert)) {
      value.names = {static_cast<lumi::PhotoName&>(one)};
      return true;
    }
    type_caster<std::vector<lumi::PhotoName>> several;
    if (!several.load(from, convert)) return false;
    value.names = static_cast<std::vector<lumi::PhotoName>&>(several);
    return true;
  }
  static handle cast(const lumi::PhotoNames& several, return_value_policy policy, handle parent) {
    return type_caster<std::vector<lumi::PhotoName>>::cast(several.names, policy, parent);
  }
};

}  // namespace pybind11::detail
