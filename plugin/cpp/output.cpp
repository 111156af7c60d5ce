// A dataset under construction: layers and fields are those of the real driver, and features go to
// Rust.

#include "shim.h"

#include <exception>

static OGRErr AsError(bool success)
{
    return success ? OGRERR_NONE : OGRERR_FAILURE;
}

// --- dataset -------------------------------------------------------------------------------------

// Returns the driver of the format, from which ogr2ogr takes field types and layer creation
// options.
MeshmarkOutputDataset::MeshmarkOutputDataset(GDALDataset *schema, MeshmarkWriter *writer)
    : m_schema(schema), m_writer(writer)
{
    poDriver = schema->GetDriver();
    eAccess = GA_Update;
}

// Before GDAL 3.7 nothing else is called at the end. A host learns from the last message whether it
// went well.
MeshmarkOutputDataset::~MeshmarkOutputDataset()
{
    Finish();
}

#if MESHMARK_GDAL_AT_LEAST(13)
CPLErr MeshmarkOutputDataset::Close(GDALProgressFunc progress, void *of_progress)
{
    const bool finished = Finish();
    return GDALDataset::Close(progress, of_progress) == CE_None && finished ? CE_None : CE_Failure;
}
#elif MESHMARK_GDAL_AT_LEAST(7)
CPLErr MeshmarkOutputDataset::Close()
{
    const bool finished = Finish();
    return GDALDataset::Close() == CE_None && finished ? CE_None : CE_Failure;
}
#endif

bool MeshmarkOutputDataset::Finish()
{
    if (!m_writer)
        return true;
    const std::string reported = CPLGetLastErrorType() == CE_Failure ? CPLGetLastErrorMsg() : "";
    const char *failure = bSuppressOnClose     ? "the host does not want it"
                          : !reported.empty() ? reported.c_str()
                                              : nullptr;
    MeshmarkWriter *writer = m_writer;
    m_writer = nullptr;
    const bool finished = meshmark_writer_finish(writer, ToHandle(this), failure);
    m_layers.clear();
    m_schema = nullptr;
    return finished;
}

MeshmarkWriter *MeshmarkOutputDataset::Writer()
{
    CPLErrorReset();
    return m_writer;
}

MESHMARK_CONST OGRLayer *MeshmarkOutputDataset::GetLayer(int index) MESHMARK_CONST
{
    return index >= 0 && index < GetLayerCount() ? m_layers[index].get() : nullptr;
}

int MeshmarkOutputDataset::TestCapability(const char *capability) MESHMARK_CONST
{
    // A layer that cannot be created must be reported: ogr2ogr -skipfailures continues without a
    // check.
    for (const char *ours : {ODsCCreateLayer, ODsCTransactions, ODsCRandomLayerWrite})
    {
        if (EQUAL(capability, ours))
            return TRUE;
    }
    for (const char *handed_on : {ODsCCurveGeometries, ODsCMeasuredGeometries, ODsCZGeometries, ODsCAddFieldDomain})
    {
        if (EQUAL(capability, handed_on))
            return m_schema && m_schema->TestCapability(capability);
    }
    return FALSE;
}

#if MESHMARK_GDAL_AT_LEAST(9)
OGRLayer *MeshmarkOutputDataset::ICreateLayer(const char *name, const OGRGeomFieldDefn *geometry,
                                              CSLConstList options)
{
    return AddLayer(name, geometry ? geometry->GetSpatialRef() : nullptr,
                    geometry ? geometry->GetType() : wkbNone, options);
}
#else
OGRLayer *MeshmarkOutputDataset::ICreateLayer(const char *name, OGRSpatialReference *srs, OGRwkbGeometryType type,
                                              char **options)
{
    return AddLayer(name, srs, type, options);
}
#endif

OGRLayer *MeshmarkOutputDataset::AddLayer(const char *name, const OGRSpatialReference *srs, OGRwkbGeometryType type,
                                          CSLConstList options)
{
    MeshmarkWriter *writer = Writer();
    if (!writer)
        return nullptr;
    const auto handle = OGRSpatialReference::ToHandle(const_cast<OGRSpatialReference *>(srs));
    OGRLayerH schema = meshmark_writer_add_layer(writer, name, handle, type, options);
    if (!schema)
        return nullptr;
    m_layers.push_back(std::make_unique<MeshmarkOutputLayer>(*this, *OGRLayer::FromHandle(schema), GetLayerCount()));
    return m_layers.back().get();
}

OGRErr MeshmarkOutputDataset::StartTransaction(int)
{
    meshmark_writer_begin(Writer());
    return OGRERR_NONE;
}

OGRErr MeshmarkOutputDataset::CommitTransaction()
{
    return AsError(meshmark_writer_commit(Writer()));
}

// The failure that led to this remains GDAL's last one.
OGRErr MeshmarkOutputDataset::RollbackTransaction()
{
    meshmark_writer_roll_back(m_writer);
    return OGRERR_NONE;
}

const OGRFieldDomain *MeshmarkOutputDataset::GetFieldDomain(const std::string &name) const
{
    return m_schema ? m_schema->GetFieldDomain(name) : nullptr;
}

bool MeshmarkOutputDataset::AddFieldDomain(std::unique_ptr<OGRFieldDomain> &&domain, std::string &reason)
{
    return m_schema && m_schema->AddFieldDomain(std::move(domain), reason);
}

// --- layer ---------------------------------------------------------------------------------------

MeshmarkOutputLayer::MeshmarkOutputLayer(MeshmarkOutputDataset &dataset, OGRLayer &schema, int number)
    : m_dataset(dataset), m_schema(schema), m_number(number)
{
    SetDescription(schema.GetName());
}

GDALDataset *MeshmarkOutputLayer::GetDataset()
{
    return &m_dataset;
}

int MeshmarkOutputLayer::TestCapability(const char *capability) MESHMARK_CONST
{
    for (const char *ours : {OLCSequentialWrite, OLCTransactions})
    {
        if (EQUAL(capability, ours))
            return TRUE;
    }
    for (const char *handed_on : {OLCCreateField, OLCStringsAsUTF8, OLCCurveGeometries, OLCMeasuredGeometries,
                                  OLCZGeometries})
    {
        if (EQUAL(capability, handed_on))
            return m_schema.TestCapability(capability);
    }
    return FALSE;
}

#if MESHMARK_GDAL_AT_LEAST(9)
OGRErr MeshmarkOutputLayer::CreateField(const OGRFieldDefn *field, int approximate)
#else
OGRErr MeshmarkOutputLayer::CreateField(OGRFieldDefn *field, int approximate)
#endif
{
    const auto handle = OGRFieldDefn::ToHandle(const_cast<OGRFieldDefn *>(field));
    return AsError(meshmark_writer_add_field(m_dataset.Writer(), m_number, handle, approximate != 0));
}

OGRErr MeshmarkOutputLayer::ICreateFeature(OGRFeature *feature)
{
    return AsError(meshmark_writer_write(m_dataset.Writer(), m_number, OGRFeature::ToHandle(feature)));
}

OGRErr MeshmarkOutputLayer::StartTransaction()
{
    return m_dataset.StartTransaction(FALSE);
}

OGRErr MeshmarkOutputLayer::CommitTransaction()
{
    return m_dataset.CommitTransaction();
}

OGRErr MeshmarkOutputLayer::RollbackTransaction()
{
    return m_dataset.RollbackTransaction();
}
