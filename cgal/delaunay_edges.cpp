// Delaunay edges of a point set, by CGAL: a second opinion on the mesh.
//
// stdin:  u64 N, then N points as f64 x, f64 y         (little endian)
// stdout: u64 E, then E edges as u32 i, u32 j, i < j   (little endian), finite edges only, sorted
//
// With the argument "time" it writes instead how many seconds the edges took, as text.
//
// Points given more than once are one vertex, which bears the first of their indices.
// Any failure is a sentence on stderr and exit status 1.

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_data_structure_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#if !defined(__BYTE_ORDER__) || __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "the streams are copied from and to memory as they are: this needs a little-endian machine"
#endif

namespace {

using Index = std::uint32_t;
using Edge = std::array<Index, 2>;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Index, Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;
using Point = Kernel::Point_2;

void read_bytes(void* to, std::size_t size) {
    if (std::fread(to, 1, size, stdin) != size)
        throw std::runtime_error("stdin ends before the number of points it announces");
}

std::vector<Point> read_points() {
    std::uint64_t count = 0;
    read_bytes(&count, sizeof count);
    if (count > std::numeric_limits<Index>::max())
        throw std::runtime_error("there are more points than 32-bit indices");
    std::vector<Point> points; // no reserve: a wrong count must not allocate gigabytes
    for (std::uint64_t i = 0; i < count; ++i) {
        double xy[2];
        read_bytes(xy, sizeof xy);
        if (!std::isfinite(xy[0]) || !std::isfinite(xy[1]))
            throw std::runtime_error("point " + std::to_string(i) + " is not finite");
        points.emplace_back(xy[0], xy[1]);
    }
    if (std::getc(stdin) != EOF)
        throw std::runtime_error("stdin goes on after the last point");
    return points;
}

// CGAL would keep the last of equal points in its insertion order, which is not that of the input.
std::vector<std::pair<Point, Index>> first_of_equal_points(const std::vector<Point>& points) {
    std::vector<std::pair<Point, Index>> numbered;
    numbered.reserve(points.size());
    for (const Point& point : points)
        numbered.emplace_back(point, static_cast<Index>(numbered.size()));
    std::sort(numbered.begin(), numbered.end());
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    numbered.erase(std::unique(numbered.begin(), numbered.end(), same), numbered.end());
    return numbered;
}

std::vector<Edge> delaunay_edges(const std::vector<Point>& points) {
    const auto vertices = first_of_equal_points(points);
    const Delaunay triangulation(vertices.begin(), vertices.end());
    if (triangulation.number_of_vertices() != vertices.size())
        throw std::runtime_error("CGAL lost vertices");
    std::vector<Edge> edges;
    for (auto edge = triangulation.finite_edges_begin(); edge != triangulation.finite_edges_end(); ++edge) {
        const Index i = edge->first->vertex(Delaunay::cw(edge->second))->info();
        const Index j = edge->first->vertex(Delaunay::ccw(edge->second))->info();
        edges.push_back({std::min(i, j), std::max(i, j)});
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

void write_bytes(const void* from, std::size_t size) {
    if (std::fwrite(from, 1, size, stdout) != size)
        throw std::runtime_error("stdout cannot be written");
}

void write_edges(const std::vector<Edge>& edges) {
    const std::uint64_t count = edges.size();
    write_bytes(&count, sizeof count);
    write_bytes(edges.data(), edges.size() * sizeof(Edge));
    if (std::fflush(stdout) != 0)
        throw std::runtime_error("stdout cannot be written");
}

void write_seconds(const std::vector<Point>& points) {
    const auto start = std::chrono::steady_clock::now();
    const auto edges = delaunay_edges(points);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (edges.empty() || std::printf("%.9f\n", elapsed.count()) < 0)
        throw std::runtime_error("there is nothing to time");
}

} // namespace

int main(int argc, char** argv) try {
    if (argc > 1 && std::string_view(argv[1]) == "time")
        write_seconds(read_points());
    else
        write_edges(delaunay_edges(read_points()));
} catch (const std::exception& error) {
    std::fprintf(stderr, "delaunay_edges: %s\n", error.what());
    return 1;
}
