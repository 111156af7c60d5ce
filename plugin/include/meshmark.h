/*
 * meshmark.h: watermarking for programs that hold a GDAL dataset.
 *
 * Most programs do not need this header: they open "MESHMARK:<dataset>" with open options and read
 * the marked map. It is for programs that hold a dataset without a name by which it can be opened:
 * a dataset in memory, the result of a query, or one opened with options of its own.
 *
 *     CPLStringList options;
 *     options.SetNameValue("KEY", "key.json");
 *     options.SetNameValue("RECIPIENT", "ACME GmbH");
 *     GDALDatasetH marked = MeshmarkFilter(source, options.List());
 *     if (!marked) { ... CPLGetLastErrorMsg() is the reason ... }
 *     ... read `marked` by any call of GDAL ...
 *     GDALClose(marked);
 *     GDALClose(source);
 *
 * Link to ogr_MESHMARK.so, or load it and look the functions up.
 */
#ifndef MESHMARK_H_INCLUDED
#define MESHMARK_H_INCLUDED

#include "gdal.h"

CPL_C_START

#if defined(__GNUC__)
#define MESHMARK_API __attribute__((visibility("default")))
#else
#define MESHMARK_API
#endif

/*
 * Returns a read-only dataset whose layers are those of `source` with marked geometry. The options
 * are the driver's open options (KEY, RECIPIENT or MESSAGE, AMPLITUDE, ...;
 * `ogrinfo --format MESHMARK` lists them). All vertices are read once and their new places computed
 * before it returns; features then stream.
 *
 * On failure it returns NULL after exactly one CPLError, whose sentence names what is wrong and
 * what to do. It never changes `source`'s data.
 *
 * Filters and ignored fields that are set on the layers of `source` are cleared: the whole map is
 * marked. While the result is open, read the layers through it alone: both share the one position
 * that a layer of GDAL has.
 *
 * The result holds a reference to `source`. You may therefore give up yours right away with
 * GDALReleaseDataset(source). GDALClose(source), though, closes a dataset that was not opened as
 * shared at once, whoever holds references: call it only after the result is closed.
 *
 * Where the process has not loaded the MESHMARK driver yet, it is registered, since callers ask a
 * dataset for its driver. As with any dataset of GDAL, one thread at a time may use the result.
 */
GDALDatasetH MESHMARK_API MeshmarkFilter(GDALDatasetH source, CSLConstList options);

/* The version of this library, for example "0.1.0". It lives as long as the library. */
const char MESHMARK_API *MeshmarkVersion(void);

CPL_C_END

#endif
