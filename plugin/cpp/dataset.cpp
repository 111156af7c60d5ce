// A marked dataset: the source's layers, each behind a layer of ours.

#include "shim.h"

constexpr const char *DRIVER_OF_TURNS = "OSM";

MeshmarkDataset::MeshmarkDataset(GDALDataset *source, MeshmarkMarking *marking)
    : m_source(source), m_readsInTurn(source->GetDriver() && EQUAL(source->GetDriverName(), DRIVER_OF_TURNS)),
      m_marking(marking)
{
    poDriver = GetGDALDriverManager()->GetDriverByName(MESHMARK_DRIVER);
    for (int i = 0; i < source->GetLayerCount(); i++)
        m_layers.push_back(std::make_unique<MeshmarkLayer>(*this, *source->GetLayer(i), i, marking));
}

MeshmarkDataset::~MeshmarkDataset()
{
    MeshmarkDataset::CloseDependentDatasets();
}

int MeshmarkDataset::CloseDependentDatasets()
{
    EndTurn();
    m_layers.clear();
    GDALDataset *source = m_source;
    m_source = nullptr;
    if (source)
        source->ReleaseRef();
    return source != nullptr;
}

MESHMARK_CONST OGRLayer *MeshmarkDataset::GetLayer(int index) MESHMARK_CONST
{
    return index >= 0 && index < GetLayerCount() ? m_layers[index].get() : nullptr;
}

int MeshmarkDataset::TestCapability(const char *capability) MESHMARK_CONST
{
    for (const char *handed_on : {ODsCCurveGeometries, ODsCMeasuredGeometries, ODsCZGeometries})
    {
        if (EQUAL(capability, handed_on))
            return m_source && m_source->TestCapability(capability);
    }
    return FALSE;
}

// While a query is open, the source starts from the beginning and creates features of the query's
// layers only. Without one, it keeps the features of all other layers until they are read, and
// fails when they are many. With its own dataset-wide reading, ogr2ogr would take a failure for the
// end.
bool MeshmarkDataset::GiveTurn(MeshmarkLayer &layer, bool starts)
{
    if (!m_readsInTurn || m_turnOf == &layer)
        return true;
    if (!starts)
    {
        CPLError(CE_Failure, CPLE_AppDefined, "layer \"%s\" cannot be read further, as another layer was begun meanwhile: "
                 "read the layers of this format one after the other", layer.GetName());
        return false;
    }
    EndTurn();
    const std::string query = std::string("SELECT * FROM \"") + layer.GetName() + "\"";
    m_turn = m_source->ExecuteSQL(query.c_str(), nullptr, nullptr);
    m_turnOf = m_turn ? &layer : nullptr;
    layer.ApplyFiltersToSource(); // the end of the last query has cleared them
    return m_turn != nullptr;
}

void MeshmarkDataset::EndTurn()
{
    if (m_turn)
        m_source->ReleaseResultSet(m_turn);
    m_turn = nullptr;
    m_turnOf = nullptr;
}

void MeshmarkDataset::EndTurnOf(const MeshmarkLayer &layer)
{
    if (m_turnOf == &layer)
        EndTurn();
}

std::vector<std::string> MeshmarkDataset::GetFieldDomainNames(CSLConstList options) const
{
    return m_source ? m_source->GetFieldDomainNames(options) : std::vector<std::string>();
}

const OGRFieldDomain *MeshmarkDataset::GetFieldDomain(const std::string &name) const
{
    return m_source ? m_source->GetFieldDomain(name) : nullptr;
}

std::vector<std::string> MeshmarkDataset::GetRelationshipNames(CSLConstList options) const
{
    return m_source ? m_source->GetRelationshipNames(options) : std::vector<std::string>();
}

const GDALRelationship *MeshmarkDataset::GetRelationship(const std::string &name) const
{
    return m_source ? m_source->GetRelationship(name) : nullptr;
}

OGRStyleTable *MeshmarkDataset::GetStyleTable()
{
    return m_source ? m_source->GetStyleTable() : nullptr;
}

char **MeshmarkDataset::GetFileList()
{
    return m_source ? m_source->GetFileList() : nullptr;
}

MeshmarkTexts MeshmarkDataset::GetMetadata(const char *domain)
{
    return m_source ? m_source->GetMetadata(domain) : nullptr;
}

char **MeshmarkDataset::GetMetadataDomainList()
{
    return m_source ? m_source->GetMetadataDomainList() : nullptr;
}

const char *MeshmarkDataset::GetMetadataItem(const char *name, const char *domain)
{
    return m_source ? m_source->GetMetadataItem(name, domain) : nullptr;
}
