// The driver's classes, and the border between C++ and Rust.
//
// GDAL's C API cannot make a driver, so a dataset and a layer are subclassed here. They pass every
// call to the source; Rust answers what concerns the mark.

#pragma once

#include "gdal_priv.h"
#include "ogrsf_frmts.h"

#include <memory>
#include <vector>

// GDAL 3.13 made lists of texts const, 3.12 the getters, 3.11 merged the overloads of extents and
// spatial filters (RFC 107), 3.9 changed a parameter of SetIgnoredFields.
#define MESHMARK_GDAL_AT_LEAST(minor) (GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, minor, 0))
#if MESHMARK_GDAL_AT_LEAST(12)
#define MESHMARK_CONST const
#else
#define MESHMARK_CONST
#endif
#if MESHMARK_GDAL_AT_LEAST(13)
typedef CSLConstList MeshmarkTexts;
#else
typedef char **MeshmarkTexts;
#endif
#if MESHMARK_GDAL_AT_LEAST(9)
typedef CSLConstList MeshmarkFieldNames;
#else
typedef const char **MeshmarkFieldNames;
#endif

constexpr const char *MESHMARK_DRIVER = "MESHMARK";
// PREFIX of dataset/src/marked_view.rs is the same for Rust.
constexpr const char *MESHMARK_PREFIX = "MESHMARK:";

// --- from C++ to Rust (src/ffi.rs) ---------------------------------------------------------------
// No function throws or unwinds. Those that can fail report it with exactly one CPLError.

struct MeshmarkMarking; // the Rust side of one marked dataset

extern "C"
{
    // Opens the dataset `name` and marks it; nullptr on failure. The caller releases *source.
    MeshmarkMarking *meshmark_open(const char *name, CSLConstList options, GDALDatasetH *source);
    // Marks an open dataset; nullptr on failure. Clears the filters of its layers.
    MeshmarkMarking *meshmark_mark(GDALDatasetH source, CSLConstList options);
    void meshmark_free(MeshmarkMarking *);

    // Returns whether the vertices of this layer move.
    bool meshmark_marks_layer(const MeshmarkMarking *, const char *layer);
    // Moves every coordinate of a geometry and returns their number, or -1 on failure.
    int64_t meshmark_move(const MeshmarkMarking *, const char *layer, GIntBig fid, unsigned char *wkb, size_t size);
    // Returns the furthest movement of any vertex along x and y, CRS units.
    void meshmark_reach(const MeshmarkMarking *, double *x, double *y);
    // Returns false and reports a failure when the source's files are no longer those that were
    // marked.
    bool meshmark_source_is_unchanged(const MeshmarkMarking *);

    // Returns false and reports a failure when layer number `number` has not yielded as many
    // features as were marked.
    bool meshmark_is_complete(const MeshmarkMarking *, const char *layer, int number, uint64_t features);

    // Removes places from the native data of a feature; returns whether its foreign members hold
    // some (src/ffi_native_data.rs).
    void meshmark_clear_native_data(OGRFeatureH);
    // The native data of a layer, without places; the caller frees it.
    char **meshmark_native_data(CSLConstList metadata);

    // Returns whether writing to `name` would destroy the source of an open marked dataset.
    bool meshmark_is_being_read(const char *name);
    // Reports that it is being read, and first saves a copy if a writer may overwrite it all the
    // same.
    void meshmark_refuse_to_write(const char *name, bool copy_first);
    // Return the XML lists of open and creation options, which live as long as the process.
    const char *meshmark_option_list();
    const char *meshmark_creation_option_list();
}

// --- from C++ to Rust, while a host writes (src/ffi_writer.rs) -----------------------------------

struct MeshmarkWriter; // the Rust side of a dataset under construction

extern "C"
{
    // Begins the file `name`; nullptr on failure. *schema is an empty dataset of the real driver
    // that lives as long as the writer.
    MeshmarkWriter *meshmark_writer_new(const char *name, CSLConstList options, GDALDatasetH *schema);
    // Creates a layer and returns the empty one of the real driver, nullptr on failure.
    OGRLayerH meshmark_writer_add_layer(MeshmarkWriter *, const char *name, OGRSpatialReferenceH,
                                        OGRwkbGeometryType, CSLConstList options);
    bool meshmark_writer_add_field(MeshmarkWriter *, int layer, OGRFieldDefnH, bool approximate);
    // Stages a feature and sets its id.
    bool meshmark_writer_write(MeshmarkWriter *, int layer, OGRFeatureH);
    void meshmark_writer_begin(MeshmarkWriter *);
    // Returns false when no transaction is open.
    bool meshmark_writer_commit(MeshmarkWriter *);
    void meshmark_writer_roll_back(MeshmarkWriter *);
    // Marks and publishes unless the host failed with `host_failure`; frees the writer. Metadata
    // and styles are those of `described`.
    bool meshmark_writer_finish(MeshmarkWriter *, GDALDatasetH described, const char *host_failure);

    // Reports why a marked map is not opened for update.
    void meshmark_writer_refuse_update(const char *name);
    // Reports that the name lacks the prefix.
    void meshmark_writer_refuse_bare(const char *name);
}

struct MeshmarkFree
{
    void operator()(MeshmarkMarking *marking) const { meshmark_free(marking); }
};

// --- the driver ----------------------------------------------------------------------------------

class MeshmarkDataset;

class MeshmarkLayer final : public OGRLayer
{
  public:
    MeshmarkLayer(MeshmarkDataset &dataset, OGRLayer &source, int number, const MeshmarkMarking *marking);

    void ResetReading() override;
    OGRFeature *GetNextFeature() override;
    OGRErr SetNextByIndex(GIntBig index) override;
    OGRFeature *GetFeature(GIntBig fid) override;
    GIntBig GetFeatureCount(int force) override;
    int TestCapability(const char *capability) MESHMARK_CONST override;

    OGRErr SetAttributeFilter(const char *query) override;
    OGRErr SetIgnoredFields(MeshmarkFieldNames names) override;
#if MESHMARK_GDAL_AT_LEAST(11)
    OGRErr ISetSpatialFilter(int field, const OGRGeometry *geometry) override;
    OGRErr IGetExtent(int field, OGREnvelope *extent, bool force) override;
#else
    void SetSpatialFilter(OGRGeometry *geometry) override;
    void SetSpatialFilter(int field, OGRGeometry *geometry) override;
    OGRErr GetExtent(OGREnvelope *extent, int force) override;
    OGRErr GetExtent(int field, OGREnvelope *extent, int force) override;
#endif

    MeshmarkTexts GetMetadata(const char *domain) override;
    const char *GetMetadataItem(const char *name, const char *domain) override;

    // Handed on as they are.
    char **GetMetadataDomainList() override { return m_source.GetMetadataDomainList(); }
    const char *GetName() MESHMARK_CONST override { return m_source.GetName(); }
    OGRwkbGeometryType GetGeomType() MESHMARK_CONST override { return m_source.GetGeomType(); }
    MESHMARK_CONST OGRFeatureDefn *GetLayerDefn() MESHMARK_CONST override { return m_source.GetLayerDefn(); }
    MESHMARK_CONST OGRSpatialReference *GetSpatialRef() MESHMARK_CONST override { return m_source.GetSpatialRef(); }
    const char *GetFIDColumn() MESHMARK_CONST override { return m_source.GetFIDColumn(); }
    const char *GetGeometryColumn() MESHMARK_CONST override { return m_source.GetGeometryColumn(); }
    int FindFieldIndex(const char *name, int exact) override { return m_source.FindFieldIndex(name, exact); }
    OGRStyleTable *GetStyleTable() override { return m_source.GetStyleTable(); }
    GDALDataset *GetDataset() override;

    // Gives the source's layer the filters and ignored fields of this one.
    void ApplyFiltersToSource();

  private:
    OGRFeatureUniquePtr ReadNext();
    void CheckEnd() const;
    bool Mark(OGRFeature &feature);
    bool MarkGeometry(OGRFeature &feature, int field);
    bool PassesFilters(OGRFeature &feature);
    void DropIgnoredGeometry(OGRFeature &feature) const;

    // Whether the source alone decides which features are read, or we drop some of them.
    bool SourceFilters() const { return !m_marked || (!m_poFilterGeom && !m_evaluatesGeometry); }
    bool HasStraightEdges(int field) const;
    bool NamesGeometry(const char *query) const;
    void ApplySpatialFilterToSource();
    OGRErr ApplyIgnoredFieldsToSource();
    OGRErr Extent(int field, OGREnvelope *extent, bool force);
    bool MeasureExtents();

    MeshmarkDataset &m_dataset;
    OGRLayer &m_source;
    const int m_number;
    const MeshmarkMarking *const m_marking;
    const bool m_marked;
    CPLStringList m_nativeData;       // words of a GeoJSON file, without places
    bool m_evaluatesGeometry = false; // the attribute filter does
    bool m_readsAll = false;          // whatever the filters
    bool m_ended = false;
    bool m_fromStart = true; // no reader has jumped to a feature
    uint64_t m_came = 0;     // features of the source since the last reset
    int m_untilCheck = 0;
    CPLStringList m_ignored;                // as the user gave them
    std::vector<int> m_ignoredButRead;      // geometry fields among them that a filter needs
    std::vector<unsigned char> m_wkb;       // one geometry, reused
    std::vector<OGREnvelope> m_extents;     // one a geometry field, once measured
};

class MeshmarkDataset final : public GDALDataset
{
  public:
    // Takes over a reference to `source`, and `marking`.
    MeshmarkDataset(GDALDataset *source, MeshmarkMarking *marking);
    ~MeshmarkDataset() override;

    int GetLayerCount() MESHMARK_CONST override { return static_cast<int>(m_layers.size()); }
    MESHMARK_CONST OGRLayer *GetLayer(int index) MESHMARK_CONST override;
    bool IsLayerPrivate(int index) const override { return m_source && m_source->IsLayerPrivate(index); }
    int TestCapability(const char *capability) MESHMARK_CONST override;

    // Whether the source creates features of all layers in one pass over its file, so that only one
    // layer can be read at a time.
    bool ReadsInTurn() const { return m_readsInTurn; }
    // Makes a layer readable from its start, or further; returns false and reports a failure when
    // another one has been begun since.
    bool GiveTurn(MeshmarkLayer &layer, bool starts);
    void EndTurn();
    void EndTurnOf(const MeshmarkLayer &layer);

    // Handed on as they are.
    std::vector<std::string> GetFieldDomainNames(CSLConstList options) const override;
    const OGRFieldDomain *GetFieldDomain(const std::string &name) const override;
    std::vector<std::string> GetRelationshipNames(CSLConstList options) const override;
    const GDALRelationship *GetRelationship(const std::string &name) const override;
    OGRStyleTable *GetStyleTable() override;
    char **GetFileList() override;
    MeshmarkTexts GetMetadata(const char *domain) override;
    char **GetMetadataDomainList() override;
    const char *GetMetadataItem(const char *name, const char *domain) override;

    int CloseDependentDatasets() override;

  private:
    GDALDataset *m_source;
    const bool m_readsInTurn;
    const MeshmarkLayer *m_turnOf = nullptr;
    OGRLayer *m_turn = nullptr; // an open query, see GiveTurn
    std::unique_ptr<MeshmarkMarking, MeshmarkFree> m_marking;
    std::vector<std::unique_ptr<MeshmarkLayer>> m_layers;
};

// --- the write side ------------------------------------------------------------------------------
// Hosts see the layers and fields of the real driver; features go to Rust.

class MeshmarkOutputDataset;

class MeshmarkOutputLayer final : public OGRLayer
{
  public:
    MeshmarkOutputLayer(MeshmarkOutputDataset &dataset, OGRLayer &schema, int number);

    void ResetReading() override {}
    OGRFeature *GetNextFeature() override { return nullptr; }
    int TestCapability(const char *capability) MESHMARK_CONST override;
#if MESHMARK_GDAL_AT_LEAST(9)
    OGRErr CreateField(const OGRFieldDefn *field, int approximate) override;
#else
    OGRErr CreateField(OGRFieldDefn *field, int approximate) override;
#endif
    OGRErr StartTransaction() override;
    OGRErr CommitTransaction() override;
    OGRErr RollbackTransaction() override;

    // Handed on as they are.
    const char *GetName() MESHMARK_CONST override { return m_schema.GetName(); }
    OGRwkbGeometryType GetGeomType() MESHMARK_CONST override { return m_schema.GetGeomType(); }
    MESHMARK_CONST OGRFeatureDefn *GetLayerDefn() MESHMARK_CONST override { return m_schema.GetLayerDefn(); }
    MESHMARK_CONST OGRSpatialReference *GetSpatialRef() MESHMARK_CONST override { return m_schema.GetSpatialRef(); }
    const char *GetFIDColumn() MESHMARK_CONST override { return m_schema.GetFIDColumn(); }
    const char *GetGeometryColumn() MESHMARK_CONST override { return m_schema.GetGeometryColumn(); }
    int FindFieldIndex(const char *name, int exact) override { return m_schema.FindFieldIndex(name, exact); }
    GDALDataset *GetDataset() override;

  protected:
    OGRErr ICreateFeature(OGRFeature *feature) override;

  private:
    MeshmarkOutputDataset &m_dataset;
    OGRLayer &m_schema;
    const int m_number;
};

class MeshmarkOutputDataset final : public GDALDataset
{
  public:
    // Takes over `writer`, to which `schema` belongs.
    MeshmarkOutputDataset(GDALDataset *schema, MeshmarkWriter *writer);
    ~MeshmarkOutputDataset() override;

    int GetLayerCount() MESHMARK_CONST override { return static_cast<int>(m_layers.size()); }
    MESHMARK_CONST OGRLayer *GetLayer(int index) MESHMARK_CONST override;
    int TestCapability(const char *capability) MESHMARK_CONST override;
    OGRErr StartTransaction(int force) override;
    OGRErr CommitTransaction() override;
    OGRErr RollbackTransaction() override;

    const OGRFieldDomain *GetFieldDomain(const std::string &name) const override;
    bool AddFieldDomain(std::unique_ptr<OGRFieldDomain> &&domain, std::string &reason) override;

#if MESHMARK_GDAL_AT_LEAST(13)
    CPLErr Close(GDALProgressFunc progress = nullptr, void *of_progress = nullptr) override;
#elif MESHMARK_GDAL_AT_LEAST(7)
    CPLErr Close() override;
#endif
    // Returns the writer for a call that writes. GDAL's last failure afterwards is a later one,
    // which Finish examines.
    MeshmarkWriter *Writer();

  protected:
#if MESHMARK_GDAL_AT_LEAST(9)
    OGRLayer *ICreateLayer(const char *name, const OGRGeomFieldDefn *geometry, CSLConstList options) override;
#else
    OGRLayer *ICreateLayer(const char *name, OGRSpatialReference *srs, OGRwkbGeometryType type,
                           char **options) override;
#endif

  private:
    OGRLayer *AddLayer(const char *name, const OGRSpatialReference *srs, OGRwkbGeometryType type,
                       CSLConstList options);
    bool Finish();

    GDALDataset *m_schema;
    MeshmarkWriter *m_writer;
    std::vector<std::unique_ptr<MeshmarkOutputLayer>> m_layers;
};

// --- from Rust to C++ ----------------------------------------------------------------------------
// rustc hides the symbols of a C++ archive, so the public functions are Rust's and come here.

extern "C"
{
    void meshmark_shim_register();
    GDALDatasetH meshmark_shim_filter(GDALDatasetH source, CSLConstList options);
    // A marked dataset that takes over a reference to `source`, and `marking`.
    GDALDatasetH meshmark_shim_view(GDALDatasetH source, MeshmarkMarking *marking);
    // A list field as a JSON array; the caller frees it. nullptr when it is not set.
    char *meshmark_shim_list_as_json(OGRFeatureH feature, int field);
}
