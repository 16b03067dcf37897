#include "inverse/normals.h"

#include "inverse/height.h"
#include "inverse/level.h"
#include "inverse/reflectance_map.h"
#include "inverse/relaxation.h"
#include "measurement/parallel.h"

namespace lobefit {

Normals estimate_normals(const Pictures& pictures, const Reflectance& f_times_cosine,
                         const NormalsOptions& options, Monitor& monitor) {
  const int threads = thread_count(options.threads);
  monitor.report("reflectance", 0);
  const ReflectanceMap map(f_times_cosine, pictures.lighting, options.floor, threads, monitor);
  const Level level = level_of(pictures, map, options.noise);
  const std::vector<Place> places = pictures.values.size() >= 3
                                        ? relaxed_from_pixels(map, level, threads, monitor)
                                        : relaxed_from_silhouette(map, level, threads, monitor);
  Normals result{pictures.grid, std::vector<Vector3>(places.size(), Vector3::Zero()), {}};
  for (std::size_t pixel = 0; pixel < places.size(); ++pixel) {
    if (pictures.grid.mask[pixel]) result.normals[pixel] = normal_at(places[pixel]);
  }
  monitor.throw_if_cancelled();
  monitor.report("height", 1);
  result.heights = integrate_normals(pictures.grid, result.normals);
  return result;
}

}  // namespace lobefit
