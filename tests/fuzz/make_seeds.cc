// make_seeds CAPTURE OUT: OUT/TARGET/..., what fuzzing starts from.
#include <cstdio>
#include <exception>

#include "tests/fuzz/seeds.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("make_seeds CAPTURE OUT\n", stderr);
    return 2;
  }
  try {
    lumi::fuzz::WriteSeeds(argv[1], argv[2]);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "make_seeds: %s\n", e.what());
    return 1;
  }
}
