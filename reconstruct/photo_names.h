// Names of photos that COLMAP's lists, our JSON or the file system's limits cannot hold, and what they are staged as.
#pragma once

#include <string>
#include <vector>

namespace lumi {

// For each name the one that the scene has for it: itself, but for
// - control characters, bytes that are no UTF-8, and blanks at the beginning and the end: =HH, the byte in hex;
// - a part of a path longer than 200 bytes: cut, with a hash, so that there is room for the endings of files made of
// it;
// - one that another photo has then: =2, =3 ... before its ending.
std::vector<std::string> SceneNames(const std::vector<std::string>& names);

}  // namespace lumi
