// Masks under the names that people and tools give them, handed on under those that COLMAP looks for.
#pragma once

#include <filesystem>

#include "reconstruct/photos.h"
#include "scene/program/progress.h"

namespace lumi {

// The mask of photo.jpg is photo.jpg.png (COLMAP's name), else photo.png, else another picture of either name, or a
// picture called photo.jpg itself; upper and lower case do not count where no name fits exactly. Of a converted photo
// (IMG.HEIC, for COLMAP IMG.HEIC.png), or one that the scene has under another name, the names are those of the user's
// file; else those that the scene has. A mask of the upright photo is turned as
// the photo is stored.
//
// Returns the folder to read masks from: `masks` where all that belong to photos are called as COLMAP wants them, or
// `staging` is empty; else `staging`, with links and copies. Says how many photos have none. Throws InputError where no
// photo has one, naming the file that was looked for.
std::filesystem::path MasksForColmap(const Capture& capture, const std::filesystem::path& masks,
                                     const std::filesystem::path& staging, ProgressSink& sink);

}  // namespace lumi
