#include "scene/model/picture_memory.h"

#include <sys/mman.h>

namespace lumi {

void WantLargePages(void* begin, std::size_t bytes) { madvise(begin, bytes, MADV_HUGEPAGE); }

}  // namespace lumi
