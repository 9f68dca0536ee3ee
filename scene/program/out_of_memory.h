// The first allocation that fails is remembered. Libraries catch std::bad_alloc and go on without what they asked for:
// a stream ends early, a ray meets nothing, a picture "cannot be opened". So nothing that is made after it is written.
#pragma once

namespace lumi {

// Begins to remember: as std::set_new_handler.
void WatchAllocations();

bool MemoryRanOut();
// Throws std::bad_alloc where memory ran out. Called before a file is put in its place.
void ThrowIfMemoryRanOut();
// Called by code that caught the failure and knows all that is missing because of it, such as the viewer, which goes on
// without a photo.
void MemoryIsBack();

}  // namespace lumi
