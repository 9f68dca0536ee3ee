// The first allocation that fails is remembered. Libraries catch std::bad_alloc and go on without what they asked for:
// a stream ends early, a ray meets nothing, a picture "cannot be opened". So nothing that is made after it is written.
#pragma once

namespace lumi {

// Begins to remember: as std::set_new_handler. Libraries that are not made for it may crash on what they half made:
// from the first failure on, `crashed` handles the signals of crashes. It has to end the program.
void WatchAllocations(void (*crashed)(int signal));

bool MemoryRanOut();
// Throws std::bad_alloc where memory ran out. Called before a file is put in its place.
void ThrowIfMemoryRanOut();

// While one lives, memory that runs out ends the program on the spot, by std::terminate (main_program.cc says why it
// ended): for what cannot be unwound. Nothing where WatchAllocations was not called.
class EndsWhereMemoryRunsOut {
 public:
  EndsWhereMemoryRunsOut();
  ~EndsWhereMemoryRunsOut();
  EndsWhereMemoryRunsOut(const EndsWhereMemoryRunsOut&) = delete;
  EndsWhereMemoryRunsOut& operator=(const EndsWhereMemoryRunsOut&) = delete;

 private:
  bool watched_;
};

// Called by code that caught the failure and knows all that is missing because of it, such as the viewer, which goes on
// without a photo. A crash is a crash again.
void MemoryIsBack();

}  // namespace lumi
