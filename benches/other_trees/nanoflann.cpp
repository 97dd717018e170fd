// nanoflann on photons that luxmap wrote: nanoflann PHOTONS.npy FLUX.npy POINTS.npy K,… RADIUS,…
// Prints one line for each measure: what, value (ms or ns a query), sum of R in m, sum of flux in lm.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nanoflann.hpp>
#include <sstream>
#include <string>
#include <vector>

// Numbers of a NumPy file of single precision as luxmap writes it.
static std::vector<float> read(const char* path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    if (bytes.size() < 10 || std::memcmp(bytes.data(), "\x93NUMPY\x01", 7) != 0) {
        std::fprintf(stderr, "%s: no NumPy file of version 1\n", path);
        std::exit(2);
    }
    size_t start = 10 + static_cast<unsigned char>(bytes[8]) + 256 * static_cast<unsigned char>(bytes[9]);
    std::vector<float> numbers((bytes.size() - start) / 4);
    std::memcpy(numbers.data(), bytes.data() + start, 4 * numbers.size());
    return numbers;
}

struct Photons {
    std::vector<float> at;
    size_t kdtree_get_point_count() const { return at.size() / 3; }
    float kdtree_get_pt(size_t photon, size_t axis) const { return at[3 * photon + axis]; }
    template <class Box> bool kdtree_get_bbox(Box&) const { return false; }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Photons>, Photons, 3, uint32_t>;

// Σ φ (1 − d²/r²), without a list.
struct KernelSum {
    float radius_squared;
    const float* flux;
    double sum = 0;
    size_t count = 0;
    using DistanceType = float;
    size_t size() const { return count; }
    bool empty() const { return count == 0; }
    bool full() const { return true; }
    bool addPoint(float distance, uint32_t photon) {
        if (distance < radius_squared) {
            sum += flux[photon] * (1 - distance / radius_squared);
            ++count;
        }
        return true;
    }
    float worstDist() const { return radius_squared; }
    void sort() {}
};

static double now() {
    using namespace std::chrono;
    return duration<double>(steady_clock::now().time_since_epoch()).count();
}

static std::vector<double> list(const char* text) {
    std::vector<double> values;
    std::stringstream stream(text);
    for (std::string part; std::getline(stream, part, ',');) values.push_back(std::atof(part.c_str()));
    return values;
}

int main(int argc, char** argv) {
    if (argc != 6) return 2;
    Photons photons{read(argv[1])};
    std::vector<float> flux = read(argv[2]), points = read(argv[3]);
    double count = points.size() / 3.0, start = now();
    // Since 1.4 the constructor builds the tree.
    Tree tree(3, photons, nanoflann::KDTreeSingleIndexAdaptorParams(32));
    std::printf("build %.9g 0 0\n", 1e3 * (now() - start));
    for (double value : list(argv[4])) {
        size_t k = static_cast<size_t>(value);
        std::vector<uint32_t> found(k);
        std::vector<float> distances(k);
        double radii = 0, sum = 0;
        start = now();
        for (size_t i = 0; i < points.size(); i += 3) {
            size_t n = tree.knnSearch(&points[i], k, found.data(), distances.data());
            for (size_t j = 0; j < n; ++j) sum += flux[found[j]];
            if (n > 0) radii += std::sqrt(distances[n - 1]);
        }
        std::printf("%zu %.9g %.9g %.9g\n", k, 1e9 * (now() - start) / count, radii, sum);
    }
    for (double radius : list(argv[5])) {
        double sum = 0;
        start = now();
        for (size_t i = 0; i < points.size(); i += 3) {
            KernelSum within{static_cast<float>(radius * radius), flux.data()};
#if NANOFLANN_VERSION >= 0x150
            tree.findNeighbors(within, &points[i]);
#else
            tree.findNeighbors(within, &points[i], nanoflann::SearchParams());
#endif
            sum += within.sum;
        }
        std::printf("r%g %.9g 0 %.9g\n", radius, 1e9 * (now() - start) / count, sum);
    }
}
