// Any bytes as an RGL file: read, or refused by an InputError, and what was read can be evaluated.
#include <cstddef>
#include <cstdint>

#include "measurement/input_error.h"
#include "measurement/input_file.h"
#include "measurement/rgl.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lobefit;
  const MemoryFile bytes({data, size});
  try {
    const Rgl rgl{InputFile(bytes.path())};
    const Vector3 slanted = Vector3(0.3, 0.2, 0.7).normalized();
    for (const Vector3& other : {Vector3(0, 0, 1), Vector3(-0.9, 0.3, 0.01)}) {
      rgl.reflectance(slanted, other.normalized());
    }
  } catch (const InputError&) {
  }
  return 0;
}
